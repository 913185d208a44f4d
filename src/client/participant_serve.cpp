#include <array>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "client/participant.hpp"

namespace tfdude {
namespace {

// How long the participant of a killed predecessor may still seem alive.
constexpr Milliseconds kPredecessorGone{1500};

// How much longer than usual somebody who was met may take to say which partition it serves.
constexpr Milliseconds kSlowPresence{3000};

// How often own changes of the structure are published at most.
constexpr Milliseconds kPublishEvery{1};

std::uint64_t nanoseconds_since_epoch() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
}

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
}

// One line a change of the structure; values change too often for it.
void log_change(const Request& request, const Reply& reply) {
  std::string what;
  if (const auto* add = std::get_if<AddRequest>(&request.body)) {
    what = "add frame " + quote(request.id) + " under " + quote(add->parent);
  } else if (const auto* remove = std::get_if<RemoveRequest>(&request.body)) {
    what = "remove, with all below,";
    for (const std::string& top : remove->tops) what += " " + quote(top);
  } else if (const auto* move = std::get_if<MoveRequest>(&request.body)) {
    what = "move frame " + quote(request.id) + " under " + quote(move->parent);
  } else {
    return;
  }
  const auto* error = std::get_if<Error>(&reply.body);
  log().info("{}: {}", what, error != nullptr ? "refused: " + error->message : "done");
}

}  // namespace

Result<void> Participant::serve(const std::vector<FrameSpec>& frames) {
  const std::string name = partition_name();
  {
    const std::lock_guard lock(structure_mutex_);
    presence_ = {name,        nanoseconds_since_epoch(),
                 host_name(), static_cast<std::uint32_t>(getpid()),
                 0,           false};
  }
  if (auto claimed = claim_name(); !claimed) return claimed;
  {
    const std::lock_guard lock(structure_mutex_);
    auto partition = std::make_unique<Partition>(name, presence_.incarnation, forest_, directory_);
    if (auto loaded = partition->load(frames); !loaded) return loaded;
    partition_ = std::move(partition);
    presence_.pages = partition_->page_count();
    presence_.serving = true;
  }
  publisher_.emplace(kPublishEvery, [this] { publish_structure(); });
  if (auto serving = transport_->serve(name); !serving) return serving;
  publish_structure();
  transport_->announce(presence_);
  return {};
}

// Says that the name is to be taken, and looks round for as long as participants need to meet. Of two
// who claim at once, the earlier has it; one who was killed may still seem to serve for a moment.
Result<void> Participant::claim_name() {
  transport_->announce(presence_);
  const auto met = Clock::now() + transport_->settle_time();
  {
    std::unique_lock lock(structure_mutex_);
    structure_changed_.wait_until(lock, met, [this] { return rival_ && rival_->serving; });
  }
  while (transport_->awaits_presence() && Clock::now() < met + kSlowPresence) wait_for_news();
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_until(lock, Clock::now() + kPredecessorGone,
                                [this] { return !rival_ || !rival_->serving; });
  if (!rival_ || (!rival_->serving && rival_->incarnation > presence_.incarnation)) return {};
  return fail(Errc::kPartitionTaken, "partition " + quote(rival_->partition) +
                                         " is served already, on host " + rival_->host +
                                         " by process " + std::to_string(rival_->pid));
}

void Participant::publish_structure() {
  const std::lock_guard publishing(publish_mutex_);
  std::vector<Page> pages;
  bool more_pages = false;
  {
    const std::lock_guard lock(structure_mutex_);
    pages = partition_->take_pages();
    more_pages = partition_->page_count() != presence_.pages;
    presence_.pages = partition_->page_count();
  }
  for (const Page& page : pages) transport_->publish(page);
  if (more_pages) transport_->announce(presence_);
  structure_changed_.notify_all();
}

Reply Participant::answer_here(const Request& request) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return partition_->answer_lookup(request.sequence, *lookup);
  }
  Reply reply;
  {
    const std::lock_guard lock(structure_mutex_);
    reply = partition_->answer(request);
  }
  // This process sees the change already; the others are told without making it wait.
  if (!std::holds_alternative<UpdateRequest>(request.body)) publisher_->ask();
  return reply;
}

Result<void> Participant::change_here(const Request& request) {
  Reply reply = answer_here(request);
  if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
  return {};
}

void Participant::on_request(const PeerId& from, const Request& request) {
  if (partition_ == nullptr) return;
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    transport_->reply(from, partition_->answer_lookup(request.sequence, *lookup));
    return;
  }
  Reply reply;
  {
    const std::lock_guard lock(structure_mutex_);
    reply = partition_->answer(from, request);
  }
  log_change(request, reply);
  // Before the reply, so that whoever gets that finds the structure changed.
  if (!std::holds_alternative<UpdateRequest>(request.body)) publish_structure();
  transport_->reply(from, reply);
}

void Participant::on_update(const Update& update) {
  if (partition_ != nullptr) partition_->apply(update);
}

}  // namespace tfdude
