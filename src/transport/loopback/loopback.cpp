#include "tfdude/transport/loopback.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// The members, and what those that join late must get.
class LoopbackNetwork::Hub {
 public:
  struct Member {
    PeerId id{};
    std::string serves;
    std::set<std::uint64_t> watches;
    std::optional<Presence> presence;
    std::map<std::uint32_t, Page> pages;

    Mutex mutex;  // of the rest; not held during a call, since handlers may send
    Condition idle;
    TransportHandler* handler TFDUDE_GUARDED_BY(mutex) = nullptr;  // null: has left
    int calls TFDUDE_GUARDED_BY(mutex) = 0;                        // of the handler, under way
  };

  /// Calls the handler of each member chosen that has not left. @return how many
  template <class Choose, class Call>
  std::size_t deliver(Choose choose, Call call) {
    std::vector<std::shared_ptr<Member>> chosen;
    {
      const Lock lock(members_mutex_);
      for (const auto& member : members_) {
        if (choose(*member)) chosen.push_back(member);
      }
    }
    std::size_t reached = 0;
    for (const auto& member : chosen) reached += call_if_there(*member, call);
    return reached;
  }

  /// Waits until there is such a member; false at the deadline.
  template <class Choose>
  bool wait_for(Choose choose, Transport::Deadline deadline) {
    Lock lock(members_mutex_);
    return serving_.wait_until(lock, deadline, [&]() TFDUDE_REQUIRES(members_mutex_) {
      return std::any_of(members_.begin(), members_.end(),
                         [&](const auto& member) { return choose(*member); });
    });
  }

  void serve(Member& member, const std::string& partition) {
    {
      const Lock lock(members_mutex_);
      member.serves = partition;
    }
    serving_.notify_all();
  }

  std::shared_ptr<Member> join(TransportHandler& handler) {
    auto member = std::make_shared<Member>();
    {
      const Lock lock(member->mutex);
      member->handler = &handler;
    }
    const Lock lock(members_mutex_);
    ++joined_;
    for (std::size_t i = 0; i < sizeof joined_; ++i) {
      member->id[i] = static_cast<std::uint8_t>(joined_ >> (8 * i));
    }
    members_.push_back(member);
    return member;
  }

  void leave(const std::shared_ptr<Member>& member) {
    {
      const Lock lock(members_mutex_);
      members_.erase(std::remove(members_.begin(), members_.end(), member), members_.end());
    }
    {
      Lock lock(member->mutex);
      member->handler = nullptr;
      member->idle.wait(lock, [&]() TFDUDE_REQUIRES(member->mutex) { return member->calls == 0; });
    }
    if (!member->presence) return;
    const Lock telling(telling_mutex_);
    deliver([](const Member&) { return true; },
            [&](TransportHandler& handler) {
              handler.on_lost(member->presence->partition, member->presence->incarnation, {});
            });
  }

  /// All announced and published messages of the others, for a new member.
  std::pair<std::vector<Presence>, std::vector<Page>> published(const Member& except) {
    std::pair<std::vector<Presence>, std::vector<Page>> all;
    const Lock lock(members_mutex_);
    for (const auto& member : members_) {
      if (member.get() == &except) continue;
      if (member->presence) all.first.push_back(*member->presence);
      for (const auto& [number, page] : member->pages) all.second.push_back(page);
    }
    return all;
  }

  // Held while presences and pages are delivered, so that a joining participant gets nothing older
  // after something newer.
  Mutex telling_mutex_{LockRank::kReporting};
  Mutex members_mutex_;  // of the list and of what the members say; never held during a call

 private:
  template <class Call>
  static std::size_t call_if_there(Member& member, Call& call) {
    TransportHandler* handler = nullptr;
    {
      const Lock lock(member.mutex);
      handler = member.handler;
      if (handler == nullptr) return 0;
      ++member.calls;
    }
    call(*handler);
    const Lock lock(member.mutex);
    if (--member.calls == 0) member.idle.notify_all();
    return 1;
  }

  std::vector<std::shared_ptr<Member>> members_ TFDUDE_GUARDED_BY(members_mutex_);
  std::uint64_t joined_ TFDUDE_GUARDED_BY(members_mutex_) = 0;
  Condition serving_;
};

template <class Hub, class Message>
class LoopbackChannel final : public Channel<Message> {
 public:
  using Take = void (TransportHandler::*)(const Message&);

  LoopbackChannel(std::shared_ptr<Hub> hub, std::string partition, Take take)
      : hub_(std::move(hub)), partition_(std::move(partition)), take_(take) {}

  std::optional<Errc> try_send(const Message& message) override {
    const auto reached =
        hub_->deliver([&](const auto& member) { return member.serves == partition_; },
                      [&](TransportHandler& handler) { (handler.*take_)(message); });
    return reached > 0 ? std::nullopt : std::optional<Errc>(Errc::kTimeout);
  }

 private:
  const std::shared_ptr<Hub> hub_;
  const std::string partition_;
  const Take take_;
};

class LoopbackTransport final : public Transport {
 public:
  explicit LoopbackTransport(std::shared_ptr<LoopbackNetwork::Hub> hub) : hub_(std::move(hub)) {}
  ~LoopbackTransport() override { stop(); }
  LoopbackTransport(const LoopbackTransport&) = delete;
  LoopbackTransport& operator=(const LoopbackTransport&) = delete;

  Result<void> start(TransportHandler& handler) override {
    const Lock telling(hub_->telling_mutex_);
    self_ = hub_->join(handler);
    const auto [presences, pages] = hub_->published(*self_);
    for (const Presence& presence : presences) handler.on_presence(presence);
    for (const Page& page : pages) handler.on_page(page);
    return {};
  }

  void stop() override {
    if (self_ == nullptr) return;
    hub_->leave(self_);
    self_ = nullptr;
  }

  Result<void> serve(const std::string& partition) override {
    served_ = partition;
    hub_->serve(*self_, partition);
    return {};
  }

  void announce(const Presence& presence) override {
    const Lock telling(hub_->telling_mutex_);
    {
      const Lock lock(hub_->members_mutex_);
      self_->presence = presence;
    }
    tell_others([&](TransportHandler& handler) { handler.on_presence(presence); });
  }

  void publish(const Page& page) override {
    const Lock telling(hub_->telling_mutex_);
    {
      const Lock lock(hub_->members_mutex_);
      self_->pages[page.number] = page;
    }
    tell_others([&](TransportHandler& handler) { handler.on_page(page); });
  }

  void prepare(const std::string&) override {}

  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    return send_to(partition, deadline,
                   [&](TransportHandler& handler) { handler.on_request(self_->id, request); });
  }

  Result<void> send(const std::string& partition, const Update& update,
                    Deadline deadline) override {
    return send_to(partition, deadline,
                   [&](TransportHandler& handler) { handler.on_update(update); });
  }

  Result<void> send(const std::string& partition, const JointUpdate& update,
                    Deadline deadline) override {
    return send_to(partition, deadline,
                   [&](TransportHandler& handler) { handler.on_joints(update); });
  }

  std::unique_ptr<Channel<Update>> update_channel(const std::string& partition) override {
    return std::make_unique<To<Update>>(hub_, partition, &TransportHandler::on_update);
  }

  std::unique_ptr<Channel<JointUpdate>> joint_channel(const std::string& partition) override {
    return std::make_unique<To<JointUpdate>>(hub_, partition, &TransportHandler::on_joints);
  }

  Result<void> flush(Deadline /*deadline*/) override { return {}; }
  void reply(const PeerId& to, const Reply& reply) override {
    hub_->deliver([&](const auto& member) { return member.id == to; },
                  [&](TransportHandler& handler) { handler.on_reply(served_, reply); });
  }

  Result<void> watch(const std::string&, std::uint64_t group) override {
    const Lock lock(hub_->members_mutex_);
    self_->watches.insert(group);
    return {};
  }

  void unwatch(std::uint64_t group) override {
    const Lock lock(hub_->members_mutex_);
    self_->watches.erase(group);
  }

  void push(const PushedValues& pushed) override {
    hub_->deliver([&](const auto& member) { return member.watches.count(pushed.group) > 0; },
                  [&](TransportHandler& handler) { handler.on_pushed(pushed); });
  }

  void end_pushing(std::uint64_t) override {}

  Result<void> publish_clock(Time now) override {
    tell_others([now](TransportHandler& handler) {
      if (handler.wants_clock()) handler.on_clock(now);
    });
    return {};
  }

  [[nodiscard]] bool discovered() const override { return true; }
  [[nodiscard]] bool awaits_presence() const override { return false; }
  [[nodiscard]] Milliseconds discovery_time() const override { return Milliseconds(0); }

 private:
  using Member = LoopbackNetwork::Hub::Member;
  template <class Message>
  using To = LoopbackChannel<LoopbackNetwork::Hub, Message>;

  template <class Call>
  void tell_others(Call call) {
    hub_->deliver([self = self_.get()](const Member& member) { return &member != self; }, call);
  }

  template <class Call>
  Result<void> send_to(const std::string& partition, Deadline deadline, Call call) {
    const auto serves = [&](const Member& member) {
      return !partition.empty() && member.serves == partition;
    };
    while (hub_->wait_for(serves, deadline)) {
      if (hub_->deliver(serves, call) > 0) return {};
    }
    return fail(Errc::kTimeout, "partition " + quote(partition) + " was not reachable in time");
  }

  std::shared_ptr<LoopbackNetwork::Hub> hub_;
  std::shared_ptr<Member> self_;
  std::string served_;  // set before requests can come
};

LoopbackNetwork::LoopbackNetwork() : hub_(std::make_shared<Hub>()) {}

TransportPtr LoopbackNetwork::join() { return std::make_unique<LoopbackTransport>(hub_); }

}  // namespace tfdude
