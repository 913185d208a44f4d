#include "faults/waiter.hpp"

#include <chrono>
#include <deque>
#include <utility>

#include "faults/frames.hpp"
#include "support/process.hpp"

namespace tfdude::faults {
namespace {

using std::chrono::milliseconds;

constexpr Milliseconds kWait{600000};
constexpr milliseconds kAttendEvery{20};
constexpr milliseconds kSendEvery{10};
// A streamed value arrives within this time, also on a busy machine.
constexpr milliseconds kArrivesWithin{1500};
constexpr milliseconds kCheckEvery{200};

Transform at(double x) { return {Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}), {}}; }

}  // namespace

Waiter::Waiter(Client waiting, Client streaming, std::size_t partitions, Journal& journal)
    : waiting_(std::move(waiting)), streaming_(std::move(streaming)), journal_(journal) {
  for (std::size_t i = 0; i < partitions; ++i) {
    frames_.push_back("streamed_" + std::to_string(i));
  }
  add_frames();
  waits_ = std::thread([this] { wait(); });
  streams_ = std::thread([this] { stream(); });
}

void Waiter::stop() {
  stopping_ = true;
  for (std::thread* thread : {&waits_, &streams_}) {
    if (thread->joinable()) thread->join();
  }
}

void Waiter::add_frames() {
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    Result<void> added;
    if (!testing::eventually([&] {
          added = streaming_.add(frames_[i], base_of(i), at(0), partition_name(i));
          return added || added.error().code == Errc::kAlreadyExists;
        })) {
      journal_.violation("no frame " + frames_[i] + ": " + added.error().message);
    }
  }
}

void Waiter::wait() {
  std::vector<Waiting> waiting(frames_.size());
  while (!stopping_) {
    for (std::size_t i = 0; i < frames_.size(); ++i) attend(i, waiting[i]);
    std::this_thread::sleep_for(kAttendEvery);
  }
}

void Waiter::attend(std::size_t partition, Waiting& waiting) {
  const double calm = journal_.calm();
  if (!waiting.answer.valid()) {
    waiting = {waiting_.lookup_async("world", frames_[partition], {}, kWait), journal_.now()};
    return;
  }
  if (waiting.answer.wait_for(milliseconds(0)) == std::future_status::ready) {
    const auto found = waiting.answer.get();
    journal_.count("lookup that waits across faults", outcome_of(found));
    // Nothing but the end of its wait, or of its client, is a reason to fail.
    if (!found) journal_.violation("a waiting lookup failed: " + found.error().message);
    return;
  }
  const bool long_enough = calm > kGrace && journal_.now() - waiting.since > kGrace;
  if (!long_enough || std::exchange(waiting.reported, true)) return;
  const auto now = waiting_.lookup("world", frames_[partition]);
  journal_.violation("a lookup of " + frames_[partition] +
                     " still waits in the calm; one without " +
                     "a wait gets: " + (now ? "a pose" : now.error().message));
}

void Waiter::stream() {
  auto stream = streaming_.stream(frames_);
  if (!stream) return journal_.violation("no stream: " + stream.error().message);
  std::deque<std::pair<Clock::time_point, double>> sent;  // when, and the value
  auto next_check = Clock::now();
  for (double x = 1; !stopping_; ++x) {
    const double calm = journal_.calm();
    const auto now = Clock::now();
    const auto& missing = stream->try_publish(std::vector<Transform>(frames_.size(), at(x)));
    journal_.count("stream across faults",
                   missing.empty() ? "done" : std::string(to_string(missing.front().why)));
    if (calm > kGrace && !missing.empty()) {
      journal_.violation("a stream does not send " + frames_[missing.front().index] +
                         " in the calm: " + std::string(to_string(missing.front().why)));
    }
    sent.emplace_back(now, x);
    while (sent.size() > 1 && sent[1].first + kArrivesWithin < now) sent.pop_front();
    const bool long_ago = sent.front().first + kArrivesWithin < now;
    if (calm > kGrace + 2 && long_ago && now >= next_check) {
      next_check = now + kCheckEvery;
      for (std::size_t i = 0; i < frames_.size(); ++i) check_arrival(i, sent.front().second);
    }
    std::this_thread::sleep_until(now + kSendEvery);
  }
}

void Waiter::check_arrival(std::size_t partition, double least) {
  const double calm = journal_.calm();
  const auto X = streaming_.lookup(base_of(partition), frames_[partition]);
  // A fault meanwhile is an excuse.
  if (calm <= kGrace || journal_.calm() < calm) return;
  if (!X) {
    journal_.violation("a streamed frame is not found in the calm: " + X.error().message);
  } else if (X->pose.translation().x() < least) {
    journal_.violation(frames_[partition] + " has the value " +
                       std::to_string(X->pose.translation().x()) + " in the calm, but " +
                       std::to_string(least) + " was sent long ago");
  }
}

}  // namespace tfdude::faults
