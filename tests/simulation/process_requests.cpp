#include <algorithm>
#include <utility>

#include "simulation/process.hpp"

// What a process answers, pushes and asks for.
namespace tfdude::simulation {
namespace {

constexpr Instant kPushAfter = std::chrono::microseconds(20);
// How much later than its deadline a call may end.
constexpr Instant kEndsWithin = milliseconds(20);

}  // namespace

void Process::on_request(std::uint64_t from, const Request& request) {
  if (!serving_) return;
  world_.steps.mix((from << 32U) + request.sequence);
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return reply_to(from, member_.partition()->answer_lookup(request.sequence, *lookup));
  }
  if (std::holds_alternative<WatchRequest>(request.body)) return answer_watch(from, request);
  const auto reply = member_.on_request(peer_of(from), request, commits_.failure(), wall());
  if (reply) reply_to(from, *reply);
  react();
}

void Process::reply_to(std::uint64_t peer, const Reply& reply) {
  world_.network.send(*this, peer, &reply,
                      [from = id(), name = partition(), reply](Process& there) {
                        there.on_reply(from, name, reply);
                      });
}

void Process::on_reply(std::uint64_t from, const std::string& partition, const Reply& reply) {
  world_.steps.mix(reply.epoch + reply.sequence);
  if (const auto peer = peers_.find(from); peer != peers_.end()) {
    peer->second.heard.replied = true;
    show_life(peer->second);
  }
  replied_.try_emplace(reply.sequence, from);
  replies_.on_reply(partition, reply);
  const auto calls = calls_;
  for (const auto& one : calls) one->go_on();
  watches_.go_on();
}

void Process::answer_watch(std::uint64_t from, const Request& request) {
  const auto& body = std::get<WatchRequest>(request.body);
  const std::uint64_t group = watch_group(partition(), member_.presence().incarnation, body);
  auto pushed = pushes_.watch(group, body);
  Reply reply{request.sequence, 0, Done{}};
  if (pushed) {
    pushed_groups_.insert(group);
    reply.body = *std::move(pushed);
  } else {
    reply.body = std::move(pushed.error());
  }
  reply_to(from, reply);
}

void Process::on_update(const Update& update) {
  if (!serving_) return;
  world_.steps.mix(update.edges.size());
  if (member_.partition()->apply(update) > 0) world_.count("a streamed value was applied");
  world_.invariants.streamed(*this, update);
}

void Process::on_update(const JointUpdate& update) {
  if (!serving_) return;
  world_.steps.mix(update.joints.size());
  if (member_.partition()->apply(update)) world_.count("a streamed joint was moved");
}

void Process::wake() { push_by(now() + kPushAfter); }

// As a job of a Loop.
void Process::push_by(Pushes::Clock::time_point time) {
  if (time >= push_at_) return;
  push_at_ = time;
  later("push", time - now(), [this, time] {
    if (push_at_ != time) return;
    push_at_ = Pushes::kNever;
    push_by(pushes_.run());
  });
}

void Process::push(const PushedValues& pushed) {
  const std::uint64_t number = ++pushed_;
  for (const std::uint64_t peer : world_.network.met_by(*this)) {
    if (peers_.count(peer) > 0) continue;  // an owner, none of which watches
    world_.network.send(*this, peer, &pushed, [from = id(), number, pushed](Process& there) {
      there.on_pushed(from, number, pushed);
    });
  }
}

void Process::on_pushed(std::uint64_t from, std::uint64_t number, const PushedValues& pushed) {
  world_.steps.mix(pushed.group + pushed.commit);
  watches_.on_pushed(from, number, pushed);
}

void Process::on_watcher(std::uint64_t group) { pushes_.tell_all(group); }

void Process::listen(const std::string& partition, std::uint64_t group) {
  each_server(partition, [this, group](std::uint64_t peer) {
    world_.network.send(*this, peer, {}, [group](Process& there) { there.on_watcher(group); });
  });
}

void Process::begin(const std::string& what, std::shared_ptr<Task> task, RunningCall::Then then) {
  const auto call = std::make_shared<RunningCall>(*this, std::move(task), std::move(then));
  calls_.push_back(call);
  const auto over = [weak = std::weak_ptr(call)] {
    const auto one = weak.lock();
    return !one || one->over();
  };
  world_.invariants.called(shared_from_this(), over, what,
                           world_.timeline.now() + RunningCall::kTimeout + kEndsWithin);
  call->start();
}

std::uint64_t Process::replied_by(const Part& part) const {
  if (part.owner == kHeldHere) return id();
  const auto by = replied_.find(part.request.sequence);
  return by != replied_.end() ? by->second : 0;
}

Reply Process::answer(const Request& request) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return member_.partition()->answer_lookup(request.sequence, *lookup);
  }
  Reply reply = member_.answer(request, commits_.failure(), wall());
  world_.invariants.answered(*this, request, reply);
  react();
  return reply;
}

Result<void> Process::forget(const std::string& partition) {
  world_.forgotten[partition] = world_.timeline.now();
  auto forgotten = member_.forget(partition, wall());
  react();
  return forgotten;
}

// As that of DDS, it does not tell whether there is anybody.
Result<void> Process::send(const std::string& partition, const Request& request,
                           TimeLimit::Clock::time_point) {
  each_server(partition, [&](std::uint64_t peer) {
    peers_[peer].used = world_.timeline.now();
    world_.network.send(*this, peer, &request, [from = id(), request](Process& there) {
      there.on_request(from, request);
    });
  });
  return {};
}

void Process::each_server(const std::string& partition,
                          const std::function<void(std::uint64_t)>& tell) {
  for (const std::uint64_t peer : world_.network.met_by(*this)) {
    const auto known = peers_.find(peer);
    const bool serves = known != peers_.end() && known->second.said &&
                        known->second.said->partition == partition && known->second.said->serving;
    if (serves) tell(peer);
  }
}

}  // namespace tfdude::simulation
