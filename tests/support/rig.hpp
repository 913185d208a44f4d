#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "runtime/context.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"
#include "support/catch.hpp"
#include "support/relay.hpp"

// For tests of one part of a participant: the objects that the parts need, and owners whose replies
// a test may determine.
namespace tfdude::testing {

[[nodiscard]] inline Options quick() {
  Options options;
  options.timeout = Milliseconds(300);
  options.discovery = Milliseconds(50);
  return options;
}

/// The objects that most parts of a participant need, connected as Participant does it.
class Rig : private OwnPartition {
 public:
  explicit Rig(TransportPtr to, const std::string& partition = "", const Options& with = quick())
      : options(with),
        structure(with.clock, partition),
        transport(std::move(to)),
        discovery(structure, *transport, options.discovery, options.timeout),
        context{options, structure, *transport, discovery, member, requests, threads},
        member(context, partition, heed_),
        requests(structure, discovery, *transport, static_cast<OwnPartition&>(*this)) {
    REQUIRE(transport->start(ear_));
  }
  ~Rig() override {
    member.stop_events();
    threads.callbacks.stop();
    member.stop();
    transport->stop();
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  [[nodiscard]] tfdude::Deadline deadline() const { return discovery.call_deadline(); }

  void on_page(const Page& page) { member.on_page(page); }
  void on_presence(const Presence& presence) { member.on_presence(presence); }
  void on_lost(const std::string& partition, std::uint64_t incarnation) {
    member.on_lost(partition, incarnation, {});
  }

  const ParticipantOptions options;
  std::function<void()> on_contest;
  std::function<void(const PushedValues&)> pushed;
  std::function<Result<void>()> owns_partition;  // else the member's
  std::atomic<int> routes{0};
  std::mutex mutex;
  std::vector<std::string> gone;  // partitions; under mutex
  class Heed final : public MemberRunner::Listeners {
   public:
    explicit Heed(Rig& rig) : rig_(rig) {}

    void on_routes() override { ++rig_.routes; }
    void on_gone(const std::string& name) override {
      {
        const std::lock_guard lock(rig_.mutex);
        rig_.gone.push_back(name);
      }
      rig_.requests.replies().on_lost(name);
    }
    void on_contest() override {
      if (rig_.on_contest) rig_.on_contest();
    }

   private:
    Rig& rig_;
  };
  Heed heed_{*this};
  Structure structure;
  TransportPtr transport;
  Threads threads;
  Discovery discovery;
  const Context context;
  MemberRunner member;
  Requests requests;

 private:
  [[nodiscard]] Reply answer_own(const Request& request) override { return member.answer(request); }
  void announce_changes(const tfdude::Deadline& deadline) override { member.tell(deadline); }
  [[nodiscard]] Result<void> await_stored(const tfdude::Deadline& deadline) override {
    return member.await_stored(deadline);
  }
  [[nodiscard]] Result<void> check_owns_partition() override {
    return owns_partition ? owns_partition() : member.check_owns_partition();
  }

  /// Passes on what is received. Not the Rig itself, whose virtual functions change as a class
  /// derived from it is destroyed, while the transport still calls.
  class Ear final : public TransportHandler {
   public:
    explicit Ear(Rig& rig) : rig_(rig) {}

    void on_request(const PeerId& from, const Request& request) override {
      if (auto reply = rig_.member.on_request(from, request)) rig_.transport->reply(from, *reply);
    }
    void on_reply(const std::string& from, const Reply& reply) override {
      rig_.requests.replies().on_reply(from, reply);
    }
    void on_update(const Update&) override {}
    void on_joints(const JointUpdate&) override {}
    void on_pushed(const PushedValues& values) override {
      if (rig_.pushed) rig_.pushed(values);
    }
    void on_page(const Page& page) override { rig_.on_page(page); }
    void on_presence(const Presence& presence) override { rig_.on_presence(presence); }
    void on_lost(const std::string& partition, std::uint64_t incarnation,
                 std::chrono::nanoseconds) override {
      rig_.on_lost(partition, incarnation);
    }
    [[nodiscard]] bool owns(std::string_view id) const override {
      return rig_.structure.forest.holds(id);
    }
    [[nodiscard]] bool owns_joint(std::string_view) const override { return true; }

   private:
    Rig& rig_;
  };
  Ear ear_{*this};
};

/// An owner; a test answers or loses some of its requests.
class ScriptedOwner {
 public:
  /// @return whether the request goes no further
  using Script = std::function<bool(Transport& transport, const PeerId& from, const Request&)>;

  ScriptedOwner(LoopbackNetwork& network, const std::string& name,
                const std::vector<FrameSpec>& frames, Script script = {}) {
    auto ear = std::make_unique<Ear>(network.join(), std::move(script));
    ear_ = ear.get();
    node_.emplace(Node::open(std::move(ear), name, frames).value());
  }

  Node& node() { return *node_; }
  [[nodiscard]] int asked() const { return ear_->asked; }
  /// The participant ends in order, and announces that.
  void leave() { node_.reset(); }

 private:
  class Ear final : public Relay {
   public:
    Ear(TransportPtr real, Script script) : Relay(std::move(real)), script_(std::move(script)) {}
    std::atomic<int> asked{0};

   private:
    void on_request(const PeerId& from, const Request& request) override {
      ++asked;
      if (!script_ || !script_(real(), from, request)) Relay::on_request(from, request);
    }
    const Script script_;
  };

  Ear* ear_ = nullptr;
  std::optional<Node> node_;
};

}  // namespace tfdude::testing
