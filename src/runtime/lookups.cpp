#include "runtime/lookups.hpp"

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"

namespace tfdude {
namespace {

// Of a client that asks for frames: how old the route of a lookup that waits may be, and how long
// other waiting lookups may be delayed by asking for it.
constexpr Milliseconds kMaxAge{1000};
constexpr Milliseconds kPatience{200};

Error not_asked_yet(const std::string& a, const std::string& b) {
  return {Errc::kTimeout, "no time to look " + quote(b) + " up in " + quote(a)};
}

}  // namespace

Lookups::Lookups(const Context& context, const WatchClient& watches)
    : structure_(context.structure),
      discovery_(context.discovery),
      requests_(context.requests),
      timeout_(context.options.timeout),
      pending_(context.structure.forest, context.requests.calls(), hints_, context.threads,
               links(context.transport, watches)) {}

PendingLookups::Links Lookups::links(Transport& transport, const WatchClient& watches) {
  return {[this](const PendingLookups::Wanted& wanted) { return plan(wanted); },
          [&transport](const std::string& partition, const Request& request) -> Result<void> {
            auto sent = transport.send(partition, request, Deadline::Clock::now());
            if (!sent && sent.error().code == Errc::kTimeout) sent.error().code = Errc::kNotYet;
            return sent;
          },
          [this](const Request& request) { return requests_.answer_here(request); },
          [&watches](const PendingLookups::Wanted& wanted) {
            return watches.can_answer(wanted.a, wanted.b, wanted.query);
          },
          [this](Error last, const Deadline& deadline) {
            return requests_.last_word(std::move(last), deadline);
          },
          [this] { return structure_.clock.now(); },
          timeout_,
          requests_.on_demand() != nullptr};
}

Result<Gathering> Lookups::plan(const PendingLookups::Wanted& wanted) {
  if (auto ok = requests_.still_in(); !ok) return tl::unexpected(std::move(ok.error()));
  const auto& [a, b, query] = wanted;
  if (auto ok = requests_.know({a, b}, kMaxAge, Deadline(kPatience)); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  const auto hint = query.at ? std::nullopt : hints_.guess(a, b);
  const Lock lock(structure_.mutex);
  return routed(structure_.directory, a, b, query, hint).map([&, &a = a, &b = b](LookupPlan plan) {
    return Gathering(std::move(plan), a, b, hint);
  });
}

// The age of an instant is a difference of two times, which must be of one clock.
Result<LookupPlan> Lookups::routed(const Directory& directory, const std::string& a,
                                   const std::string& b, const Query& query,
                                   std::optional<Time> hint) const {
  auto plan = route_lookup(structure_.forest, directory, a, b, query, hint);
  if (!plan || !query.age_noise_until) return plan;
  const std::string differs = other_clock(directory, plan->parts);
  if (differs.empty()) return plan;
  return fail(Errc::kInvalidInput,
              "no process noise can be added until another instant: " + differs);
}

void Lookups::explain(Error& error, const std::vector<Part>& parts) const {
  const Lock lock(structure_.mutex);
  const std::string differs = other_clock(structure_.directory, parts);
  if (!differs.empty()) error.message += "; " + differs;
}

std::string Lookups::other_clock(const Directory& directory, const std::vector<Part>& parts) const {
  const ClockKind own = structure_.clock.kind();
  for (const Part& part : parts) {
    const auto theirs = part.owner == kHeldHere ? std::nullopt : directory.info(part.owner).clock;
    if (!theirs || *theirs == own) continue;
    return "partition " + quote(part.partition) + " uses the " + to_string(*theirs) +
           " clock, and this participant the " + to_string(own) + " clock";
  }
  return {};
}

Result<StampedTransform> Lookups::elsewhere(std::string_view a, std::string_view b,
                                            const Query& query, const Deadline& deadline) {
  const std::string start(a);
  const std::string end(b);
  const auto hint = query.at ? std::nullopt : hints_.guess(a, b);
  return requests_.retry_on_stale_route(
      deadline,
      [&] {
        return std::vector<std::string>{start, end};
      },
      [&](const Directory& directory) { return routed(directory, start, end, query, hint); },
      [&](LookupPlan& plan) {
        Gathering gathering(std::move(plan), start, end, hint);
        while (true) {
          auto found = gathering.take(requests_.ask(gathering.parts(), deadline), hints_);
          if (!found) continue;
          if (!*found && is_of_time(found->error())) explain(found->error(), gathering.parts());
          return *std::move(found);
        }
      });
}

Result<StampedTransform> Lookups::elsewhere(Handle a, Handle b, const Query& query,
                                            const Deadline& deadline) {
  const auto start = structure_.forest.info(a);
  const auto end = structure_.forest.info(b);
  // The forest's own error says which one is unknown.
  if (!start || !end) return structure_.forest.lookup(a, b, query);
  return elsewhere(start->id, end->id, query, deadline);
}

Result<StampedTransform> Lookups::wait(std::string_view a, std::string_view b, const Query& query,
                                       Milliseconds wait) {
  const Deadline deadline(wait);
  // Without another thread, since the data usually exists.
  auto found = lookup(a, b, query, deadline.within(timeout_));
  if (found || deadline.over() || !is_worth_waiting(found.error(), query)) return found;
  return pending_.add({std::string(a), std::string(b), query}, deadline, std::move(found.error()))
      .get();
}

std::shared_ptr<void> Lookups::start(const std::string& a, const std::string& b, const Query& query,
                                     Milliseconds wait, PendingLookups::Callback callback) {
  auto call = pending_.add({a, b, query}, Deadline(wait), not_asked_yet(a, b), std::move(callback));
  return {nullptr, [call](void*) { call->close(); }};
}

std::future<Result<StampedTransform>> Lookups::start(const std::string& a, const std::string& b,
                                                     const Query& query, Milliseconds wait) {
  return pending_.add({a, b, query}, Deadline(wait), not_asked_yet(a, b));
}

}  // namespace tfdude
