#include "runtime/joint_calls.hpp"

#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "base/mutex.hpp"

namespace tfdude {

void JointCalls::on_joints(const JointUpdate& update) {
  if (member_.partition() == nullptr) return;
  const auto moved = member_.apply(update);
  // Nobody else gets this error. Late samples are counted, as for any edge. Logs the 1st, 2nd, 4th,
  // 8th...
  if (moved || moved.error().code != Errc::kInvalidInput) return;
  const std::uint64_t before = refused_++;
  if (((before + 1) & before) == 0) {
    log().warn("rejected positions of joints ({} times so far): {}", before + 1,
               moved.error().message);
  }
}

// All owners of a joint get the update, so all must be known.
Result<void> JointCalls::update(const JointUpdate& update) {
  if (update.joints.empty()) return {};
  if (auto ok = requests_.check_keeps_all("move joints"); !ok) return ok;
  const Deadline deadline = discovery_.call_deadline();
  if (auto all = discovery_.await(deadline); !all) return all;
  return requests_.change(deadline, {}, [&](const Directory& directory) {
    auto parts = route_joints(directory, update);
    if (!parts) return parts;
    if (auto ok = check_reachable(directory, *parts); !ok) parts = tl::unexpected(ok.error());
    return parts;
  });
}

Result<void> JointCalls::publish(const JointUpdate& update) {
  if (update.joints.empty()) return {};
  if (auto ok = requests_.check_keeps_all("move joints"); !ok) return ok;
  const Deadline deadline = discovery_.call_deadline();
  if (auto all = discovery_.await(deadline); !all) return all;
  if (auto ok = member_.check_owns_partition(); !ok) return ok;
  JointUpdate known{{}, update.stamp};
  Result<void> outcome;
  Result<std::vector<Part>> parts;
  {
    const Lock lock(structure_.mutex);
    for (const JointValue& joint : update.joints) {
      auto route = structure_.directory.route_joint(joint.name);
      if (route) {
        known.joints.push_back(joint);
      } else if (outcome) {
        outcome = tl::unexpected(std::move(route.error()));
      }
    }
    parts = route_joints(structure_.directory, known);
  }
  if (!parts) return tl::unexpected(std::move(parts.error()));
  const auto share_of = [&](std::size_t i) -> const JointUpdate& {
    return std::get<JointUpdate>((*parts)[i].request.body);
  };
  auto sent = requests_.publish(*parts, deadline, share_of, [this](const JointUpdate& own) {
    return member_.apply(own).map([](std::size_t) {});
  });
  if (outcome) return sent;
  return tl::unexpected(requests_.last_word(std::move(outcome.error()), deadline));
}

Result<std::vector<JointInfo>> JointCalls::list(const std::string& partition,
                                                const Deadline& deadline) {
  std::vector<JointInfo> all;
  while (true) {
    const std::string last = all.empty() ? std::string() : all.back().name;
    auto more = requests_.ask_all<JointInfo>(partition, JointsRequest{last}, deadline);
    if (!more) return more;
    const bool end = more->size() < kMaxItems;
    if (!more->empty() && more->back().name <= last) {
      return fail(Errc::kInvalidInput,
                  "partition " + quote(partition) + " repeats the same joints");
    }
    std::move(more->begin(), more->end(), std::back_inserter(all));
    if (end) return all;
  }
}

}  // namespace tfdude
