#include "tfdude/base/id.hpp"

#include "runtime/participant.hpp"

// Lookups at an instant over several partitions, those that wait, and what is kept of the past.
namespace tfdude {
namespace {

Error not_asked_yet(const std::string& a, const std::string& b) {
  return {Errc::kTimeout, "no time to look " + quote(b) + " up in " + quote(a)};
}

}  // namespace

Result<std::vector<SegmentValues>> Participant::ask_values(std::vector<Part>& parts,
                                                           const Deadline& deadline) {
  return values_of(requests_.ask(parts, deadline));
}

Result<StampedTransform> Participant::lookup_elsewhere(std::string_view a, std::string_view b,
                                                       const Query& query,
                                                       const Deadline& deadline) {
  const std::string start(a);
  const std::string end(b);
  const auto hint = query.at ? std::nullopt : hints_.guess(a, b);
  return requests_.retry_on_stale_route(
      deadline,
      [&] {
        return route_lookup(structure_.forest, structure_.directory, start, end, query, hint);
      },
      [&](LookupPlan& plan) {
        Gathering gathering(std::move(plan), start, end, hint);
        while (true) {
          auto found = gathering.take(requests_.ask(gathering.parts(), deadline), hints_);
          if (found) return *std::move(found);
        }
      });
}

Result<StampedTransform> Participant::lookup_elsewhere(Handle a, Handle b, const Query& query,
                                                       const Deadline& deadline) {
  const auto start = structure_.forest.info(a);
  const auto end = structure_.forest.info(b);
  // The forest's own error says which.
  if (!start || !end) return structure_.forest.lookup(a, b, query);
  return lookup_elsewhere(start->id, end->id, query, deadline);
}

Result<StampedTransform> Participant::lookup_by(std::string_view a, std::string_view b,
                                                const Query& query, const Deadline& deadline) {
  auto local = structure_.forest.lookup(a, b, query);
  if (local || is_of_time(local.error())) return local;
  return lookup_elsewhere(a, b, query, deadline);
}

Result<StampedTransform> Participant::lookup_waiting(std::string_view a, std::string_view b,
                                                     const Query& query, Milliseconds wait) {
  const Deadline deadline(wait);
  // Without another thread, as what is wanted is there as a rule.
  auto found = lookup_by(a, b, query, deadline.within(options_.timeout));
  if (found || deadline.over() || !is_worth_waiting(found.error(), query)) return found;
  return lookups_.add({std::string(a), std::string(b), query}, deadline, std::move(found.error()))
      .get();
}

std::shared_ptr<void> Participant::lookup_async(const std::string& a, const std::string& b,
                                                const Query& query, Milliseconds wait,
                                                Lookups::Callback callback) {
  auto call = lookups_.add({a, b, query}, Deadline(wait), not_asked_yet(a, b), std::move(callback));
  return {nullptr, [call](void*) { call->cancel(); }};
}

std::future<Result<StampedTransform>> Participant::lookup_async(const std::string& a,
                                                                const std::string& b,
                                                                const Query& query,
                                                                Milliseconds wait) {
  return lookups_.add({a, b, query}, Deadline(wait), not_asked_yet(a, b));
}

Lookups::Links Participant::links_of_lookups() {
  return {[this](const Lookups::Wanted& wanted) -> Result<Gathering> {
            if (auto ok = still_in(); !ok) return tl::unexpected(std::move(ok.error()));
            const auto& [a, b, query] = wanted;
            const auto hint = query.at ? std::nullopt : hints_.guess(a, b);
            const std::lock_guard lock(structure_.mutex);
            return route_lookup(structure_.forest, structure_.directory, a, b, query, hint)
                .map([&, &a = a, &b = b](LookupPlan plan) {
                  return Gathering(std::move(plan), a, b, hint);
                });
          },
          [this](const std::string& partition, const Request& request) -> Result<void> {
            auto sent = transport_->send(partition, request, Clock::now());
            if (!sent && sent.error().code == Errc::kTimeout) sent.error().code = Errc::kNotYet;
            return sent;
          },
          [this](const Request& request) { return answer_here(request); },
          [this](const Lookups::Wanted& wanted) {
            const Watches* watches = watching_.load();
            return watches != nullptr && watches->can_answer(wanted.a, wanted.b, wanted.query);
          },
          [this](Error last, const Deadline& deadline) {
            return discovery_.last_word(std::move(last), deadline);
          },
          wall_clock,
          options_.timeout};
}

Result<std::vector<PastInfo>> Participant::past(const std::string& id) {
  const Deadline deadline = call_deadline();
  return requests_.retry_on_stale_route(
      deadline,
      [&]() -> Result<Part> {
        const auto info = structure_.forest.info(id);
        if (!info) return fail(Errc::kUnknownFrame, "no frame " + quote(id));
        return route_to(structure_.directory, info->owner, Request{0, id, PastRequest{}});
      },
      [&](Part& part) { return requests_.ask_list<PastInfo>(std::move(part), deadline); });
}

Result<std::vector<PastInfo>> Participant::pasts(const std::string& partition) {
  return requests_.ask_all<PastInfo>(partition, PastRequest{true}, call_deadline());
}

}  // namespace tfdude
