#include "simulation/watch.hpp"

#include <utility>

#include "simulation/process.hpp"

namespace tfdude::simulation {
namespace {

constexpr Instant kRenewEvery = milliseconds(1000);
constexpr Instant kRetryAfter = milliseconds(50);

}  // namespace

void Watch::attend() {
  look();
  process_.later("watch", kRetryAfter, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->attend();
  });
}

void Watch::look() {
  path_.collect();
  const Instant now = process_.world().timeline.now();
  if (routed_by_ == process_.inputs() && now < renew_at_ && path_.up_to_date()) return;
  auto route = watch_route(process_.forest(), process_.directory(), path_.a(), path_.b(), false,
                           std::chrono::nanoseconds(0), 0);
  if (!route) {
    const bool goes_on =
        path_.live() && !path_.is_gone(route.error(), process_.world().timeline.steady());
    if (!goes_on) path_.interrupt(std::move(route.error()));
    routed_by_.reset();
    return;
  }
  routed_by_ = process_.inputs();
  if (!path_.follows(*route)) {
    if (path_.live()) process_.world().count("a watched path took another route");
    (void)path_.prepare(*route);
    shown_();
  } else if (now < renew_at_ && path_.up_to_date()) {
    return;
  }
  renew_at_ = now + kRenewEvery;
  ask(*route);
}

void Watch::ask(WatchRoute& route) {
  asked_.clear();
  for (std::size_t i = 0; i < route.parts.size(); ++i) {
    open(route.sources[i]);
    Part& part = route.parts[i];
    part.request.sequence = process_.next_sequence();
    asked_[part.request.sequence] = route.sources[i].group;
    process_.send(part.partition, part.request);
  }
}

// DDS matches a reader a moment after its creation; the owner then sends everything again.
void Watch::open(const WatchRoute::Source& source) {
  if (!opened_.insert(source.group).second) return;
  const auto wait = std::chrono::microseconds(process_.world().random.index(50'000));
  process_.later("match", wait, [weak = weak_from_this(), source] {
    const auto self = weak.lock();
    if (!self) return;
    self->heard_.insert(source.group);
    self->process_.listen(source.partition, source.group);
  });
}

void Watch::on_reply(const Reply& reply) {
  const auto asked = asked_.find(reply.sequence);
  if (asked == asked_.end()) return;
  const auto* pushed = std::get_if<PushedValues>(&reply.body);
  if (pushed != nullptr && pushed->group == asked->second) return take(*pushed);
  const auto* error = std::get_if<Error>(&reply.body);
  if (!path_.live()) path_.interrupt(error ? *error : Error{Errc::kNotOwner, "another group"});
}

// A DDS reader drops a sample that arrives after a later sample of the same writer.
void Watch::on_pushed(std::uint64_t from, std::uint64_t number, const PushedValues& pushed) {
  if (heard_.count(pushed.group) == 0) return;
  std::uint64_t& newest = newest_[from];
  if (number <= newest) return;
  newest = number;
  process_.world().count("something was pushed");
  take(pushed);
}

void Watch::take(const PushedValues& pushed) {
  (void)path_.take(pushed);
  shown_();
}

}  // namespace tfdude::simulation
