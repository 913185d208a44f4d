#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "transport/port.hpp"

namespace tfdude::testing {

/// Everything that a transport passed to one participant, in order of arrival.
struct Heard {
  std::vector<Request> requests;
  std::vector<Reply> replies;
  std::vector<Update> updates;
  std::vector<JointUpdate> joints;
  std::vector<PushedValues> pushed;
  std::vector<Page> pages;
  std::vector<Presence> presences;
  std::vector<std::pair<std::string, std::uint64_t>> lost;
  std::size_t after_close = 0;  ///< calls after close(), which are errors

  [[nodiscard]] bool page(const std::string& partition, std::uint32_t number,
                          std::uint64_t epoch) const {
    return std::any_of(pages.begin(), pages.end(), [&](const Page& page) {
      return page.partition == partition && page.number == number && page.epoch == epoch;
    });
  }
  [[nodiscard]] bool presence(const std::string& partition, std::uint64_t incarnation) const {
    return std::any_of(presences.begin(), presences.end(), [&](const Presence& presence) {
      return presence.partition == partition && presence.incarnation == incarnation;
    });
  }
  [[nodiscard]] bool loss(const std::string& partition, std::uint64_t incarnation) const {
    return std::count(lost.begin(), lost.end(), std::pair(partition, incarnation)) > 0;
  }
  [[nodiscard]] bool reply(std::uint32_t sequence) const {
    return std::any_of(replies.begin(), replies.end(),
                       [&](const Reply& reply) { return reply.sequence == sequence; });
  }
};

/// The numbers of requests or replies, sorted, each once: what is repeated may arrive twice.
template <class Message>
[[nodiscard]] std::set<std::uint32_t> sequences(const std::vector<Message>& messages) {
  std::set<std::uint32_t> numbers;
  for (const Message& message : messages) numbers.insert(message.sequence);
  return numbers;
}

/// Records what arrives, for tests that wait until it has.
class Recorder final : public TransportHandler {
 public:
  /// Working code never takes longer.
  static constexpr std::chrono::seconds kLong{20};

  /// Set before the transport starts: what to do with a request besides recording it.
  std::function<void(const PeerId&, const Request&)> answer;
  /// Set before the transport starts: what to do with a presence besides recording it.
  std::function<void()> greet;
  /// Set before the transport starts: the frames held here.
  std::set<std::string, std::less<>> frames;
  /// Likewise, the joints that move them.
  std::set<std::string, std::less<>> joints;

  /// Waits until condition(heard) holds; false if it does not in time.
  template <class Condition>
  [[nodiscard]] bool hears(Condition condition, std::chrono::milliseconds patience = kLong) const {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, patience, [&] { return condition(heard_); });
  }

  [[nodiscard]] Heard heard() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }

  /// After this call nothing may arrive.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }

  void on_request(const PeerId& from, const Request& request) override {
    record([&] { heard_.requests.push_back(request); });
    if (answer) answer(from, request);
  }
  void on_reply(const std::string&, const Reply& reply) override {
    record([&] { heard_.replies.push_back(reply); });
  }
  void on_update(const Update& update) override {
    record([&] { heard_.updates.push_back(update); });
  }
  void on_joints(const JointUpdate& update) override {
    record([&] { heard_.joints.push_back(update); });
  }
  void on_pushed(const PushedValues& pushed) override {
    record([&] { heard_.pushed.push_back(pushed); });
  }
  void on_page(const Page& page) override {
    record([&] { heard_.pages.push_back(page); });
  }
  void on_presence(const Presence& presence) override {
    record([&] { heard_.presences.push_back(presence); });
    if (greet) greet();
  }
  void on_lost(const std::string& partition, std::uint64_t incarnation,
               std::chrono::nanoseconds) override {
    record([&] { heard_.lost.emplace_back(partition, incarnation); });
  }
  [[nodiscard]] bool owns(std::string_view id) const override { return frames.count(id) != 0; }
  [[nodiscard]] bool owns_joint(std::string_view name) const override {
    return joints.count(name) != 0;
  }

 private:
  template <class Record>
  void record(Record add) {
    {
      const std::lock_guard lock(mutex_);
      add();
      if (closed_) ++heard_.after_close;
    }
    arrived_.notify_all();
  }

  mutable std::mutex mutex_;
  mutable std::condition_variable arrived_;
  Heard heard_;
  bool closed_ = false;
};

/// One participant of a network that only records.
struct Listener {
  explicit Listener(const Join& join) : transport(join("")) { REQUIRE(transport->start(recorder)); }

  template <class Condition>
  [[nodiscard]] bool hears(Condition condition) const {
    return recorder.hears(condition);
  }
  [[nodiscard]] Heard heard() const { return recorder.heard(); }

  /// Sends a request and waits for the reply; repeats the request, because it may be lost.
  [[nodiscard]] bool ask(const std::string& partition, const Request& request) {
    const auto end = soon(Recorder::kLong);
    while (std::chrono::steady_clock::now() < end) {
      if (!transport->send(partition, request, end)) return false;
      const auto replied = [&](const Heard& h) { return h.reply(request.sequence); };
      if (recorder.hears(replied, std::chrono::milliseconds(100))) return true;
    }
    return false;
  }

  static Transport::Deadline soon(std::chrono::milliseconds after) {
    return std::chrono::steady_clock::now() + after;
  }

  Recorder recorder;  // outlives the transport
  TransportPtr transport;

 protected:
  Listener(const Join& join, const std::string& partition) : transport(join(partition)) {}
};

/// A participant that also serves a partition: it answers each request with its incarnation as
/// epoch.
struct Server : Listener {
  Server(const Join& join, std::string name, std::uint64_t life = 1,
         std::set<std::string, std::less<>> frames = {},
         std::set<std::string, std::less<>> joints = {})
      : Listener(join, name), partition(std::move(name)), incarnation(life) {
    recorder.frames = std::move(frames);
    recorder.joints = std::move(joints);
    recorder.answer = [this](const PeerId& from, const Request& request) {
      transport->reply(from, {request.sequence, incarnation, Done{}});
    };
    REQUIRE(transport->start(recorder));
    REQUIRE(transport->serve(partition));
    transport->announce({partition, incarnation, "tower", 4711, 0, true});
  }

  void publish(std::uint32_t number, std::uint64_t epoch, std::vector<PageEntry> entries = {}) {
    transport->publish({partition, number, incarnation, epoch, std::move(entries)});
  }

  const std::string partition;
  const std::uint64_t incarnation;
};

}  // namespace tfdude::testing
