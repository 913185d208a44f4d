#include "runtime/on_demand.hpp"

#include <algorithm>
#include <optional>
#include <thread>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// How long to wait for one owner before another one is asked.
constexpr Milliseconds kPatienceWithOwner{250};

// Pauses while no owner can answer yet.
constexpr Milliseconds kFirstPause{1};
constexpr Milliseconds kLastPause{50};

// Whether the same owner may answer later.
bool may_pass(Errc code) {
  return code == Errc::kNotYet || code == Errc::kTimeout || code == Errc::kUnreachable ||
         code == Errc::kNotOwner;
}

// Whether another owner may answer.
bool is_of_owner(Errc code) { return code == Errc::kUnsupported || code == Errc::kNotPermitted; }

std::string name_of(const FramesRequest& request) {
  return request.ids.empty() ? "the frames that are followed" : "frame " + quote(request.ids[0]);
}

}  // namespace

OnDemand::OnDemand(Structure& structure, Discovery& discovery, std::vector<std::string> follow,
                   Links links)
    : structure_(structure),
      discovery_(discovery),
      follow_(std::move(follow)),
      links_(std::move(links)),
      asked_(structure.forest, structure.directory) {}

Result<bool> OnDemand::know(const std::vector<std::string>& ids, Milliseconds max_age,
                            const Deadline& deadline) {
  const auto since = max_age == Task::kAnyAge ? Clock::time_point::min() : Clock::now() - max_age;
  FramesRequest request;
  bool some_known = false;
  {
    const Lock lock(structure_.mutex);
    auto lacking = asked_.lacking(ids, since);
    if (lacking.empty()) return false;
    for (const std::string& id : ids) some_known = some_known || asked_.knows(id, since);
    request = asked_.request(std::move(lacking), follows_ ? std::vector<std::string>() : follow_);
  }
  if (auto answer = ask(request, deadline); !answer) {
    return tl::unexpected(std::move(answer.error()));
  }
  return !some_known;
}

Result<std::vector<KnownFrame>> OnDemand::followed(const Deadline& deadline) {
  FramesRequest request;
  {
    const Lock lock(structure_.mutex);
    request = asked_.request({}, follow_);
  }
  if (follow_.empty()) return std::vector<KnownFrame>{};
  return ask(request, deadline);
}

void OnDemand::outdate() {
  const Lock lock(structure_.mutex);
  asked_.outdate();
}

Result<std::vector<KnownFrame>> OnDemand::ask(const FramesRequest& request,
                                              const Deadline& deadline) {
  std::optional<Error> last;
  std::size_t refusals = 0;
  Milliseconds pause = kFirstPause;
  for (std::size_t turn = 0; !deadline.over(); ++turn) {
    std::vector<Owner> owners;
    {
      const Lock lock(structure_.mutex);
      owners = structure_.directory.reachable_owners();
    }
    if (owners.empty()) {
      if (discovery_.complete()) return nobody(request);
      discovery_.wait_for_change(deadline);
      continue;
    }
    const auto asked = Clock::now();
    const Owner owner = owners[turn % owners.size()];
    auto answer = ask_one(owner, request, deadline);
    if (answer) {
      if (may_lack(request, *answer, deadline)) {
        merge(*answer, ask_others(owner, request, deadline));
      }
      take(request, *answer, asked);
      await_owners(*answer, deadline);
      return answer;
    }
    last = std::move(answer.error());
    refusals = is_of_owner(last->code) ? refusals + 1 : 0;
    const bool all_refuse = refusals >= owners.size() && discovery_.complete();
    if (all_refuse || !(may_pass(last->code) || is_of_owner(last->code))) {
      return tl::unexpected(*std::move(last));
    }
    std::this_thread::sleep_until(deadline.within(pause).at());
    pause = std::min(2 * pause, kLastPause);
  }
  if (!last) {
    const Error open{Errc::kTimeout, name_of(request) + " may exist"};
    return tl::unexpected(discovery_.undecided(open, deadline));
  }
  return fail(Errc::kTimeout, "no partition has said where " + name_of(request) + " is, within " +
                                  deadline.text() + ": " + last->message);
}

Result<std::vector<KnownFrame>> OnDemand::ask_one(Owner owner, const FramesRequest& request,
                                                  const Deadline& deadline) {
  std::vector<Part> parts;
  {
    const Lock lock(structure_.mutex);
    auto part = route_to(structure_.directory, owner,
                         Request{0, structure_.directory.name(owner), request});
    if (!part) return tl::unexpected(std::move(part.error()));
    parts.push_back(*std::move(part));
  }
  Reply reply = std::move(links_.ask(parts, deadline.within(kPatienceWithOwner)).front());
  if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
  auto* answer = std::get_if<std::vector<KnownFrame>>(&reply.body);
  if (answer == nullptr) {
    return fail(Errc::kUnsupported, "partition " + quote(parts[0].partition) +
                                        " gave another answer than that it was asked for");
  }
  return std::move(*answer);
}

std::vector<KnownFrame> OnDemand::ask_others(Owner asked, const FramesRequest& request,
                                             const Deadline& deadline) {
  std::vector<Part> parts;
  {
    const Lock lock(structure_.mutex);
    for (const Owner owner : structure_.directory.reachable_owners()) {
      const std::string& name = structure_.directory.name(owner);
      if (owner != asked) parts.push_back({owner, name, Request{0, name, request}});
    }
  }
  std::vector<KnownFrame> all;
  if (parts.empty()) return all;
  for (Reply& reply : links_.ask(parts, deadline.within(kPatienceWithOwner))) {
    auto* known = std::get_if<std::vector<KnownFrame>>(&reply.body);
    if (known != nullptr) merge(all, std::move(*known));
  }
  return all;
}

bool OnDemand::may_lack(const FramesRequest& request, const std::vector<KnownFrame>& answer,
                        const Deadline& deadline) {
  const auto is_missing = [&answer](const std::string& id) {
    return std::none_of(answer.begin(), answer.end(),
                        [&id](const KnownFrame& frame) { return frame.id == id; });
  };
  if (request.trees.empty() && std::none_of(request.ids.begin(), request.ids.end(), is_missing)) {
    return false;
  }
  // Others may not have told yet who is lost.
  while (!discovery_.complete() && !deadline.over()) discovery_.wait_for_change(deadline);
  const Lock lock(structure_.mutex);
  const auto partitions = structure_.directory.partitions();
  return std::any_of(partitions.begin(), partitions.end(),
                     [](const PartitionInfo& partition) { return !partition.reachable; });
}

// Nobody was discovered, so there are no frames; or all have left, so nobody can say.
Result<std::vector<KnownFrame>> OnDemand::nobody(const FramesRequest& request) {
  std::vector<PartitionInfo> partitions;
  {
    const Lock lock(structure_.mutex);
    partitions = structure_.directory.partitions();
  }
  if (!partitions.empty()) {
    return fail(Errc::kUnreachable, "no partition is reachable that could say where " +
                                        name_of(request) + " is: partition " +
                                        quote(partitions.front().name) + " " +
                                        why_absent(partitions.front()));
  }
  std::vector<KnownFrame> none;
  take(request, none, Clock::now());
  return none;
}

void OnDemand::take(const FramesRequest& request, const std::vector<KnownFrame>& answer,
                    Clock::time_point asked) {
  bool changed = false;
  {
    const Lock lock(structure_.mutex);
    const std::uint64_t before = structure_.forest.structure_version();
    asked_.take(request, answer, asked);
    if (!request.trees.empty()) follows_ = true;
    changed = structure_.forest.structure_version() != before;
  }
  if (!changed) return;
  structure_.changed.notify_all();
  links_.on_routes();
}

// A new participant may get the answer of one owner before it has discovered the others.
void OnDemand::await_owners(const std::vector<KnownFrame>& answer, const Deadline& deadline) {
  const auto all_there = [&] {
    const Lock lock(structure_.mutex);
    for (const KnownFrame& frame : answer) {
      const auto owner = structure_.directory.owner(frame.partition);
      if (!owner || !structure_.directory.reachable(*owner)) return false;
    }
    return true;
  };
  while (!all_there() && !discovery_.complete() && !deadline.over()) {
    discovery_.wait_for_change(deadline);
  }
}

}  // namespace tfdude
