#include "runtime/lookups.hpp"

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"

namespace tfdude {
namespace {

// Of a client that asks for frames: how old the route of a lookup that waits may be, and how long
// other waiting lookups may be delayed by asking for it.
constexpr Milliseconds kMaxAgeOfRoute{1000};
constexpr Milliseconds kPatienceForRoute{200};

Error not_asked_yet(const std::string& a, const std::string& b) {
  return {Errc::kTimeout, "no time to look " + quote(b) + " up in " + quote(a)};
}

}  // namespace

Lookups::Lookups(const Context& context, const WatchClient& watches, MemoryReads* memory)
    : structure_(context.structure),
      discovery_(context.discovery),
      requests_(context.requests),
      watches_(watches),
      memory_(memory),
      timeout_(context.options.timeout),
      pending_(context.structure.forest, context.requests.replies(), context.requests, hints_,
               static_cast<LookupHost&>(*this), context.threads, timeout_) {}

Result<LookupInProgress> Lookups::plan(const WantedLookup& wanted) {
  if (auto ok = requests_.check_owns_partition(); !ok) return tl::unexpected(std::move(ok.error()));
  if (auto ok = requests_.know({wanted.a, wanted.b}, kMaxAgeOfRoute, Deadline(kPatienceForRoute));
      !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  const Lock lock(structure_.mutex);
  return LookupInProgress::plan(structure_.forest, structure_.directory, structure_.clock.kind(),
                                wanted, hints_, Deadline::Clock::now());
}

Result<StampedTransform> Lookups::elsewhere(std::string_view a, std::string_view b,
                                            const Query& query, const Deadline& deadline) {
  LookupTask task(structure_.forest, structure_.clock.kind(), hints_,
                  {std::string(a), std::string(b), query});
  const auto done = requests_.run(task, deadline);
  const bool of_last = query.last_known && !query.believed_at && memory_ != nullptr;
  if (!done && done.error().code == Errc::kUnreachable && of_last) {
    if (auto last = memory_->last_known(std::string(a), std::string(b), query)) return last;
  }
  if (!done) return tl::unexpected(done.error());
  asked(task.parts());
  return std::move(task.X_AB());
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

// As other calls, one that does not wait for data asks once, and has Options::timeout for that.
template <class... Callback>
auto Lookups::begin(const std::string& a, const std::string& b, const Query& query,
                    Milliseconds wait, Callback... callback) {
  const bool waits = wait > Milliseconds(0);
  return pending_.add({a, b, query, !waits}, waits ? Deadline(wait) : discovery_.call_deadline(),
                      not_asked_yet(a, b), std::move(callback)...);
}

std::shared_ptr<void> Lookups::start(const std::string& a, const std::string& b, const Query& query,
                                     Milliseconds wait, PendingLookups::Callback callback) {
  auto call = begin(a, b, query, wait, std::move(callback));
  return {nullptr, [call](void*) { call->close(); }};
}

std::future<Result<StampedTransform>> Lookups::start(const std::string& a, const std::string& b,
                                                     const Query& query, Milliseconds wait) {
  return begin(a, b, query, wait);
}

}  // namespace tfdude
