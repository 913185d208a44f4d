#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/types/not_sent.hpp"

#include "base/mutex.hpp"
#include "runtime/mailbox.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// One destination of an edge or joint.
struct Destination {
  Owner owner = kHeldHere;
  std::string partition;
  bool reachable = true;

  friend bool operator==(const Destination& a, const Destination& b) {
    return a.owner == b.owner && a.partition == b.partition && a.reachable == b.reachable;
  }
};

/// Where the values of an edge or joint go.
struct Destinations {
  std::string name{};  ///< that the owners know
  std::vector<Destination> to{};
  std::optional<Errc> none{};  ///< why there is none

  friend bool operator==(const Destinations& a, const Destinations& b) {
    return a.name == b.name && a.to == b.to && a.none == b.none;
  }
};

/// What a sender needs of the participant.
template <class Message>
class SenderLinks {
 public:
  virtual ~SenderLinks() = default;
  /// The current owners of each name.
  [[nodiscard]] virtual std::vector<Destinations> find(const std::vector<std::string>& names) = 0;
  [[nodiscard]] virtual std::unique_ptr<Channel<Message>> connect(const std::string& partition) = 0;
  /// Applies it to this process's own part. Must not wait or, on success, allocate.
  [[nodiscard]] virtual Result<void> apply_here(const Message& message) = 0;
  /// Whether this process has lost its partition. Must not wait.
  [[nodiscard]] virtual bool out() const = 0;
};

/// A sender of any kind, for the thread that plans for all.
class PlannedSender {
 public:
  virtual ~PlannedSender() = default;
  /// The structure or the reachable partitions have changed.
  virtual void plan() = 0;
  /// After it has returned nothing is sent, and no link is used.
  virtual void close() = 0;
};

/// The implementation of a stream: one message per owner, created once and filled again for each
/// sample. Messages are created elsewhere and taken over when they are ready (Mailbox), so that the
/// sending thread neither waits nor allocates.
/// @par Thread safety  send() may be used by one thread at a time; the other functions by any.
template <class Message>
class Sender final : public PlannedSender {
 public:
  /// @param names  without duplicates
  Sender(std::vector<std::string> names, std::shared_ptr<SenderLinks<Message>> links)
      : names_(std::move(names)), links_(std::move(links)), listed_(names_.size(), 0) {
    not_sent_.reserve(names_.size());
  }

  [[nodiscard]] std::size_t size() const { return names_.size(); }

  void plan() override {
    const Lock lock(planning_);
    mailbox_.collect();
    if (closed_) return;
    auto found = links_->find(names_);
    if (planned_ && found == found_) return;
    mailbox_.put(plan_for(found));
    found_ = std::move(found);
    planned_ = true;
  }

  void close() override {
    const Lock planning(planning_);
    const Lock sending(sending_);
    closed_ = true;
    mailbox_.put(Plan{});
    (void)mailbox_.newest();
    mailbox_.collect();
  }

  /// @param valid  whether the value with this index may be sent
  /// @param fill   writes the value into an item of a message
  template <class Valid, class Fill>
  const std::vector<NotSent>& send(std::optional<Time> stamp, Valid valid, Fill fill) {
    forget_list();
    // Otherwise only close() locks it.
    if (!sending_.try_lock()) return list_all(Errc::kTransport);
    const Lock lock(sending_, std::adopt_lock);
    if (closed_) return list_all(Errc::kTransport);
    if (links_->out()) return list_all(Errc::kPartitionTaken);
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (!valid(i)) list(i, Errc::kInvalidInput, {});
    }
    Plan* plan = mailbox_.newest();
    if (!not_sent_.empty() || plan == nullptr) return not_sent_;
    for (const auto& [i, why] : plan->unroutable) list(i, why, {});
    for (Share& share : plan->shares) {
      auto& items = items_of(share.message);
      for (std::size_t k = 0; k < items.size(); ++k) fill(items[k], share.indices[k]);
      share.message.stamp = stamp;
      const auto refused = hand_over(share);
      if (!refused) continue;
      for (const std::size_t i : share.indices) list(i, *refused, share.partition);
    }
    return not_sent_;
  }

  /// Lists all as not sent.
  const std::vector<NotSent>& refuse(Errc why) {
    forget_list();
    return list_all(why);
  }

 private:
  struct Share {
    Owner owner = kHeldHere;
    std::string partition;
    bool reachable = true;
    std::unique_ptr<Channel<Message>> channel;  // null if held here
    Message message;
    std::vector<std::size_t> indices;  // of its items
  };
  struct Plan {
    std::vector<Share> shares;
    std::vector<std::pair<std::size_t, Errc>> unroutable;
  };

  static std::vector<EdgeUpdate>& items_of(Update& update) { return update.edges; }
  static std::vector<JointValue>& items_of(JointUpdate& update) { return update.joints; }

  Share& share_of(Plan& plan, const Destination& to) const {
    for (Share& share : plan.shares) {
      if (share.owner == to.owner) return share;
    }
    plan.shares.push_back({to.owner, to.partition, to.reachable, nullptr, {}, {}});
    Share& fresh = plan.shares.back();
    if (to.owner != kHeldHere) fresh.channel = links_->connect(to.partition);
    return fresh;
  }

  [[nodiscard]] Plan plan_for(const std::vector<Destinations>& found) const {
    Plan plan;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (found[i].none) plan.unroutable.emplace_back(i, *found[i].none);
      for (const Destination& to : found[i].to) {
        Share& share = share_of(plan, to);
        items_of(share.message).push_back({});
        set_name(items_of(share.message).back(), found[i].name);
        share.indices.push_back(i);
      }
    }
    return plan;
  }

  static void set_name(EdgeUpdate& edge, const std::string& name) { edge.id = name; }
  static void set_name(JointValue& joint, const std::string& name) { joint.name = name; }

  std::optional<Errc> hand_over(Share& share) {
    if (!share.reachable) return Errc::kUnreachable;
    if (share.channel != nullptr) return share.channel->try_send(share.message);
    const auto applied = links_->apply_here(share.message);
    return applied ? std::nullopt : std::optional<Errc>(applied.error().code);
  }

  void forget_list() {
    for (const NotSent& one : not_sent_) listed_[one.index] = 0;
    not_sent_.clear();
  }

  void list(std::size_t index, Errc why, std::string_view partition) {
    if (std::exchange(listed_[index], 1) == 0) not_sent_.push_back({index, why, partition});
  }

  const std::vector<NotSent>& list_all(Errc why) {
    for (std::size_t i = 0; i < names_.size(); ++i) list(i, why, {});
    return not_sent_;
  }

  const std::vector<std::string> names_;
  const std::shared_ptr<SenderLinks<Message>> links_;
  Mutex planning_{LockRank::kPlanning};
  std::vector<Destinations> found_ TFDUDE_GUARDED_BY(planning_);
  bool planned_ TFDUDE_GUARDED_BY(planning_) = false;
  Mutex sending_{LockRank::kSending};
  bool closed_ = false;  // guarded by both mutexes
  Mailbox<Plan> mailbox_;
  // The following belong to the sending thread.
  std::vector<NotSent> not_sent_;
  std::vector<char> listed_;
};

}  // namespace tfdude
