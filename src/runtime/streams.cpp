#include "runtime/streams.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"
#include "math/finite.hpp"
#include "partition/joints.hpp"
#include "runtime/stream_links.hpp"

namespace tfdude {
namespace {

// Minimum interval at which destinations are updated.
constexpr Milliseconds kPlanEvery{1};

Result<void> check_names(const std::vector<std::string>& names, const char* what) {
  if (names.size() > kMaxItems) {
    return fail(Errc::kInvalidInput, "a stream of " + std::to_string(names.size()) + " " + what +
                                         "s, of at most " + std::to_string(kMaxItems));
  }
  std::set<std::string_view> known;
  for (const std::string& name : names) {
    if (auto ok = check_id(name, what); !ok) return ok;
    if (!known.insert(name).second) {
      return fail(Errc::kInvalidInput, std::string(what) + " " + quote(name) + " is named twice");
    }
  }
  return {};
}

}  // namespace

Streams::Streams(const Context& context)
    : of_edges_(edge_links(context)),
      of_joints_(joint_links(context)),
      plans_(
          context.threads.calls,
          [this] {
            for (const auto& one : senders()) one->plan();
            return Loop::kNever;
          },
          kPlanEvery) {}

void Streams::stop() {
  {
    const Lock lock(mutex_);
    stopped_ = true;
  }
  plans_.stop();
  for (const auto& sender : senders()) sender->close();
}

std::vector<std::shared_ptr<PlannedSender>> Streams::senders() {
  const Lock lock(mutex_);
  std::vector<std::shared_ptr<PlannedSender>> there;
  for (const auto& known : senders_) {
    if (auto sender = known.lock()) there.push_back(std::move(sender));
  }
  senders_.assign(there.begin(), there.end());
  return there;
}

void Streams::add(const std::shared_ptr<PlannedSender>& sender) {
  const Lock lock(mutex_);
  if (stopped_) {
    sender->close();
    return;
  }
  senders_.push_back(sender);
  opened_ = true;
}

template <class Message>
std::shared_ptr<Sender<Message>> Streams::open(const std::vector<std::string>& names,
                                               const std::shared_ptr<SenderLinks<Message>>& links) {
  auto sender = std::make_shared<Sender<Message>>(names, links);
  // First, so that no change is missed meanwhile.
  add(sender);
  sender->plan();
  return sender;
}

Result<std::shared_ptr<Sender<Update>>> Streams::edges(const std::vector<std::string>& ids) {
  if (auto ok = check_names(ids, "frame"); !ok) return tl::unexpected(std::move(ok.error()));
  return open(ids, of_edges_);
}

Result<std::shared_ptr<Sender<JointUpdate>>> Streams::joints(
    const std::vector<std::string>& names) {
  if (auto ok = check_names(names, "joint"); !ok) return tl::unexpected(std::move(ok.error()));
  return open(names, of_joints_);
}

}  // namespace tfdude
