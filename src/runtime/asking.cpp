#include "runtime/asking.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// A request without a reply is repeated after this time, then after twice as long, up to the
// maximum.
constexpr Milliseconds kFirstRepeat{2};
constexpr Milliseconds kLastRepeat{160};

std::vector<std::string> asked(const std::vector<Part>& parts) {
  std::vector<std::string> partitions;
  for (const Part& part : parts) {
    if (part.owner != kHeldHere) partitions.push_back(part.partition);
  }
  return partitions;
}

}  // namespace

Asking::Asking(Calls& calls, std::vector<Part>& parts, std::function<void()> arrived)
    : parts_(parts),
      replies_(parts.size()),
      call_(calls, asked(parts), std::move(arrived)),
      pause_(kFirstRepeat) {
  for (Part& part : parts_) {
    if (part.owner == kHeldHere) continue;
    part.request.sequence = call_.entries()[requests_.size()].sequence;
    part.request.awaits_from = call_.awaits_from();
    requests_.push_back({&part.request});
  }
}

Asking::Clock::time_point Asking::send_due(Clock::time_point now, const Send& send) {
  if (now < due_) return due_;
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (call_.waits(i)) this->send(i, send);
  }
  if (sent_++ > 0) pause_ = std::min(2 * pause_, kLastRepeat);
  return due_ = Clock::now() + pause_;
}

bool Asking::send_unsent(const Send& send) {
  bool left = false;
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (!requests_[i].unsent || !call_.waits(i)) continue;
    this->send(i, send);
    left = left || requests_[i].unsent;
    if (requests_[i].unsent) continue;
    // Its first repeats come soon, however long it could not be sent: it may have been too early.
    pause_ = kFirstRepeat;
    due_ = std::min(due_, Clock::now() + pause_);
  }
  return left;
}

void Asking::send(std::size_t i, const Send& send) {
  auto sent = send(call_.entries()[i].partition, *requests_[i].request);
  requests_[i].unsent = !sent && sent.error().code == Errc::kNotYet;
  if (!sent && !requests_[i].unsent) call_.give_up(i, std::move(sent.error()));
}

void Asking::give_up(const Deadline& deadline) {
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (!call_.waits(i)) continue;
    call_.give_up(i, Error{Errc::kTimeout, "partition " + quote(call_.entries()[i].partition) +
                                               " did not answer within " + deadline.text() +
                                               " (asked " + std::to_string(sent_) + " times)"});
  }
}

const Error* Asking::answer(const std::function<Reply(const Request& request)>& here) {
  const Error* first = nullptr;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].owner != kHeldHere) continue;
    replies_[i] = here(parts_[i].request);
    if (first == nullptr) first = std::get_if<Error>(&replies_[i].body);
  }
  return first;
}

std::vector<Reply> Asking::take_replies() {
  std::size_t entry = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].owner != kHeldHere) replies_[i] = *call_.entries()[entry++].reply;
  }
  return std::move(replies_);
}

}  // namespace tfdude
