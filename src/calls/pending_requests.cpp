#include "calls/pending_requests.hpp"

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

PendingRequests::PendingRequests(ReplyTable& table, std::vector<Part>& parts,
                                 const TimeLimit& limit, ReplyListener* listener)
    : parts_(parts),
      limit_(limit),
      replies_(parts.size()),
      call_(table, asked(parts), listener),
      pause_(kFirstRepeat) {
  for (Part& part : parts_) {
    if (part.owner == kHeldHere) continue;
    const auto& entry = call_.entries()[requests_.size()];
    part.request.sequence = entry.sequence;
    part.request.awaits_from = entry.awaits_from;
    requests_.push_back({&part.request});
  }
}

PendingRequests::Clock::time_point PendingRequests::step(Clock::time_point now, RequestLink& link) {
  if (sent_ > 0 && limit_.over(now) && !has_unsent()) {
    give_up();
    return now;
  }
  (void)send_due(now, link);
  (void)answer(link);
  return send_unsent(now, link) ? now : std::min(due_, limit_.at());
}

bool PendingRequests::has_unsent() const {
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (requests_[i].unsent && call_.waits(i)) return true;
  }
  return false;
}

PendingRequests::Clock::time_point PendingRequests::send_due(Clock::time_point now,
                                                             RequestLink& link) {
  if (now < due_) return due_;
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (call_.waits(i)) send(i, now, now, link);
  }
  if (sent_++ > 0) pause_ = std::min(2 * pause_, kLastRepeat);
  return due_ = now + pause_;
}

/// @return whether any is left
bool PendingRequests::send_unsent(Clock::time_point now, RequestLink& link) {
  bool left = false;
  auto until = std::min(now + kTurn, limit_.at());
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (!requests_[i].unsent || !call_.waits(i)) continue;
    send(i, now, std::exchange(until, now), link);
    left = left || requests_[i].unsent;
    if (requests_[i].unsent) continue;
    // Its first repeats come soon, however long it could not be sent: it may have been too early.
    pause_ = kFirstRepeat;
    due_ = std::min(due_, now + pause_);
  }
  return left;
}

void PendingRequests::send(std::size_t i, Clock::time_point now, Clock::time_point until,
                           RequestLink& link) {
  auto sent = link.send(call_.entries()[i].partition, *requests_[i].request, until);
  requests_[i].unsent = !sent && sent.error().code == Errc::kTimeout && !limit_.over(now);
  if (!sent && !requests_[i].unsent) call_.give_up(i, std::move(sent.error()));
}

void PendingRequests::give_up() {
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    if (!call_.waits(i)) continue;
    const std::string& partition = call_.entries()[i].partition;
    call_.give_up(i, Error{Errc::kTimeout,
                           "partition " + quote(partition) + " did not answer within " +
                               limit_.text() + " (asked " + std::to_string(sent_) + " times)",
                           {},
                           partition});
  }
}

const Error* PendingRequests::answer(RequestLink& link) {
  if (std::exchange(answered_, true)) return nullptr;
  const Error* first = nullptr;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].owner != kHeldHere) continue;
    replies_[i] = link.answer(parts_[i].request);
    if (first == nullptr) first = std::get_if<Error>(&replies_[i].body);
  }
  return first;
}

std::vector<Reply> PendingRequests::take_replies() {
  std::size_t entry = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].owner != kHeldHere) replies_[i] = *call_.entries()[entry++].reply;
    auto* error = std::get_if<Error>(&replies_[i].body);
    if (error == nullptr || !error->partition.empty()) continue;
    error->partition = parts_[i].partition;
    // One of an earlier version does not know what it was asked.
    if (error->code != Errc::kUnsupported) continue;
    error->message.insert(0, "partition " + quote(parts_[i].partition) + ": ");
  }
  return std::move(replies_);
}

}  // namespace tfdude
