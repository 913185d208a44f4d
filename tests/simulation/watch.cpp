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

TimeLimit::Clock::time_point Watch::now() const { return process_.world().timeline.steady(); }

void Watch::look() {
  if (asked_) return;
  path_.collect();
  if (routed_by_ == process_.inputs() && now() < renew_at_ && path_.up_to_date()) return;
  auto route = watch_route(process_.forest(), process_.directory(), path_.a(), path_.b(), false,
                           std::chrono::nanoseconds(0), 0);
  if (!route) {
    const bool goes_on = path_.live() && !path_.is_gone(route.error(), now());
    if (!goes_on) path_.interrupt(std::move(route.error()));
    routed_by_.reset();
    return;
  }
  routed_by_ = process_.inputs();
  if (!path_.follows(*route)) {
    if (path_.live()) process_.world().count("a watched path took another route");
    (void)path_.prepare(*route);
    shown_();
  } else if (now() < renew_at_ && path_.up_to_date()) {
    return;
  }
  renew_at_ = now() + kRenewEvery;
  ask(*std::move(route));
}

void Watch::ask(WatchRoute route) {
  for (const WatchRoute::Source& source : route.sources) open(source);
  route_ = std::move(route);
  ++asks_;
  asked_.emplace(process_.replies(), route_->parts, TimeLimit(RunningCall::kTimeout, now()));
  step();
}

void Watch::step() {
  const auto next = asked_->step(now(), process_);
  if (asked_->complete()) return go_on();
  process_.later("watch call", next - now(), [weak = weak_from_this(), asks = asks_] {
    const auto self = weak.lock();
    if (self && self->asked_ && self->asks_ == asks) self->step();
  });
}

void Watch::go_on() {
  if (!asked_ || !asked_->complete()) return;
  const std::vector<Reply> replies = asked_->take_replies();
  asked_.reset();
  for (std::size_t i = 0; i < replies.size(); ++i) answered(replies[i], route_->sources[i]);
}

void Watch::answered(const Reply& reply, const WatchRoute::Source& source) {
  const auto* pushed = std::get_if<PushedValues>(&reply.body);
  if (pushed != nullptr && pushed->group == source.group) return take(*pushed);
  const auto* error = std::get_if<Error>(&reply.body);
  if (!path_.live()) path_.interrupt(error ? *error : Error{Errc::kNotOwner, "another group"});
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
