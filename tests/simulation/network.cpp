#include "simulation/network.hpp"

#include <algorithm>
#include <cmath>

#include "simulation/process.hpp"

namespace tfdude::simulation {
namespace {

// The delay until lost data are sent again.
constexpr milliseconds kRepeat{100};
// The share of delays that are longer than the longest, which are left out.
constexpr double kLeast = 1e-6;

Message message_of(const Sample& sample) {
  return std::visit([](const auto& one) -> Message { return &one; }, sample);
}

bool same_key(const Sample& a, const Sample& b) {
  const auto* page = std::get_if<Page>(&a);
  const auto* other = std::get_if<Page>(&b);
  if (page == nullptr || other == nullptr) return page == nullptr && other == nullptr;
  return page->number == other->number;
}

}  // namespace

std::shared_ptr<Process> Network::find(std::uint64_t process) const {
  const auto known = processes_.find(process);
  return known == processes_.end() ? nullptr : known->second.lock();
}

bool Network::reaches(std::size_t from, std::size_t to) const {
  if (from == to) return true;
  const auto parted = parted_.find(std::minmax(from, to));
  return hosts_[from].mute == 0 && hosts_[to].deaf == 0 &&
         (parted == parted_.end() || parted->second == 0);
}

Instant Network::delay() {
  const double mean = static_cast<double>(plan_.delay.count());
  return Instant(static_cast<std::int64_t>(-mean * std::log(random_.uniform(kLeast, 1))));
}

Instant Network::longest_delay() const {
  return std::chrono::duration_cast<Instant>(-std::log(kLeast) * plan_.delay) + milliseconds(1);
}

void Network::join(const std::shared_ptr<Process>& process) {
  for (const auto& [id, other] : processes_) {
    if (!other.lock()) continue;
    const auto wait = std::chrono::microseconds(5'000 + random_.index(150'000));
    timeline_.after(wait, {"meeting", process->id()},
                    [this, a = process->id(), b = id] { meet(a, b); });
  }
  processes_[process->id()] = process;
}

void Network::meet(std::uint64_t a, std::uint64_t b) {
  const auto one = find(a);
  const auto other = find(b);
  if (!one || !other) return;
  if (!reaches(one->host(), other->host()) || !reaches(other->host(), one->host())) {
    timeline_.after(kRepeat, {"meeting", a}, [this, a, b] { meet(a, b); });
    return;
  }
  open(*one, b);
  open(*other, a);
}

void Network::open(const Process& from, std::uint64_t to) {
  const Way way{from.id(), to};
  if (!channels_.try_emplace(way).second) return;
  backwards_.emplace(to, from.id());
  if (from.serves_or_claims()) find(to)->met(from.id());
  for (const Sample& sample : from.published()) put(channels_[way], sample);
  move(way);
}

std::vector<std::uint64_t> Network::met_by(const Process& one) const {
  std::vector<std::uint64_t> all;
  for (auto way = backwards_.lower_bound({one.id(), 0});
       way != backwards_.end() && way->first == one.id(); ++way) {
    if (find(way->second)) all.push_back(way->second);
  }
  return all;
}

// A sample that is replaced before it is sent is usually not sent.
void Network::put(Channel& channel, const Sample& sample) {
  const auto same = std::find_if(channel.waiting.begin(), channel.waiting.end(),
                                 [&](const Sample& other) { return same_key(other, sample); });
  const bool replaces = random_.index(2) == 0;
  if (same != channel.waiting.end() && replaces) channel.waiting.erase(same);
  channel.waiting.push_back(sample);
}

void Network::publish(const Process& from, const Sample& sample) {
  if (traffic_ != nullptr) traffic_->wrote(from.id(), message_of(sample));
  for (auto channel = channels_.lower_bound({from.id(), 0});
       channel != channels_.end() && channel->first.first == from.id(); ++channel) {
    put(channel->second, sample);
    move(channel->first);
  }
}

void Network::move(const Way& way) {
  Channel& channel = channels_[way];
  if (channel.moving || channel.waiting.empty()) return;
  channel.moving = true;
  const bool lost = random_.uniform(0, 1) < loss_;
  timeline_.after(delay() + (lost ? kRepeat : milliseconds(0)), {"sample", way.second},
                  [this, way] { arrive(way); });
}

void Network::arrive(const Way& way) {
  const auto from = find(way.first);
  const auto to = find(way.second);
  if (!from || !to) {
    channels_.erase(way);
    backwards_.erase({way.second, way.first});
    return;
  }
  Channel& channel = channels_[way];
  channel.moving = false;
  if (!reaches(from->host(), to->host()) || from->paused()) {
    channel.moving = true;
    timeline_.after(kRepeat, {"sample", way.second}, [this, way] { arrive(way); });
    return;
  }
  Sample sample = std::move(channel.waiting.front());
  channel.waiting.pop_front();
  if (traffic_ != nullptr) {
    const std::size_t bytes = traffic_->sent(way.first, message_of(sample));
    traffic_->received(way.second, bytes);
  }
  to->run([to = to.get(), id = way.first, sample = std::move(sample)] { to->hear(id, sample); });
  move(way);
}

void Network::send(const Process& from, std::uint64_t to, const Message& message,
                   std::function<void(Process&)> arrival) {
  std::size_t bytes = 0;
  if (traffic_ != nullptr) {
    traffic_->wrote(from.id(), message);
    bytes = traffic_->sent(from.id(), message);
  }
  const int copies = random_.uniform(0, 1) < plan_.repeats ? 2 : 1;
  for (int i = 0; i < copies; ++i) {
    if (random_.uniform(0, 1) < loss_) continue;
    timeline_.after(delay(), {"datagram", to}, [this, host = from.host(), to, bytes, arrival] {
      const auto there = find(to);
      if (!there || !reaches(host, there->host())) return;
      if (traffic_ != nullptr) traffic_->received(to, bytes);
      there->run([there = there.get(), arrival] { arrival(*there); });
    });
  }
}

bool Network::announces(std::uint64_t from, const Process& to) {
  const bool heard = shows_life(from, to);
  if (heard && traffic_ != nullptr) traffic_->heard_announcement(to.id());
  return heard;
}

bool Network::answers(std::uint64_t from, const Process& to) {
  if (traffic_ != nullptr) traffic_->asked_for_life(to.id());
  return shows_life(from, to);
}

bool Network::shows_life(std::uint64_t from, const Process& to) {
  const auto there = find(from);
  return there && !there->paused() && reaches(there->host(), to.host()) &&
         random_.uniform(0, 1) >= loss_;
}

}  // namespace tfdude::simulation
