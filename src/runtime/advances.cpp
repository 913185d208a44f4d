#include "runtime/advances.hpp"

#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"

namespace tfdude {

Reply Advances::answer(const Request& request) const {
  const auto& shown = std::get<TimeRequest>(request.body).shown;
  const auto now = structure_.clock.now();
  Reply reply{request.sequence, 0, Done{}};
  // Its kind may not have been announced to the one who asks yet.
  if (structure_.clock.kind() == ClockKind::kSystem) return reply;
  if (now && (!shown || *now == *shown)) return reply;
  reply.body = Error{Errc::kNotYet, now ? "the time is " + readable(*now) + " there"
                                        : std::string("the time is not known there")};
  return reply;
}

Result<void> Advances::await_others(Time time, const Deadline& deadline) {
  if (auto all = discovery_.await(deadline); !all) return all;
  std::vector<Part> late;
  {
    const Lock lock(structure_.mutex);
    for (const Owner owner : structure_.directory.reachable_owners()) {
      if (owner == kHeldHere) continue;
      const PartitionInfo& info = structure_.directory.info(owner);
      if (info.clock == ClockKind::kSystem) continue;
      late.push_back({owner, info.name, Request{0, info.name, TimeRequest{time}}});
    }
  }
  for (;;) {
    auto left = still_late(std::move(late), deadline);
    if (!left) return tl::unexpected(std::move(left.error()));
    if (left->empty()) return {};
    late = *std::move(left);
    if (deadline.over()) {
      const std::string& first = late.front().partition;
      return fail_about_partition(Errc::kTimeout,
                                  "the clock of partition " + quote(first) + " does not show " +
                                      readable(time) + " within " + deadline.text(),
                                  first);
    }
    discovery_.wait_for_change(deadline);
    // A value may be lost, and the first ones come before an owner listens.
    if (auto sent = transport_.publish_clock(time); !sent) return sent;
  }
}

Result<std::vector<Part>> Advances::still_late(std::vector<Part> asked, const Deadline& deadline) {
  if (asked.empty()) return asked;
  const std::vector<Reply> replies = requests_.ask(asked, deadline);
  std::vector<Part> late;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const auto* error = std::get_if<Error>(&replies[i].body);
    if (error == nullptr) continue;
    if (error->code != Errc::kNotYet) return tl::unexpected(*error);
    late.push_back(std::move(asked[i]));
  }
  return late;
}

}  // namespace tfdude
