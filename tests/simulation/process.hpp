#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calls/lookup_in_progress.hpp"
#include "calls/tasks.hpp"
#include "partition/claiming.hpp"
#include "partition/member.hpp"
#include "runtime/commits.hpp"
#include "runtime/pushes.hpp"
#include "simulation/clock.hpp"
#include "simulation/disk.hpp"
#include "simulation/invariants.hpp"
#include "simulation/network.hpp"
#include "simulation/planned.hpp"
#include "simulation/running_call.hpp"
#include "simulation/steps.hpp"
#include "simulation/watches.hpp"
#include "transport/silence.hpp"
#include "tree/forest.hpp"

namespace tfdude::simulation {

class Process;

/// The data that all processes of a run share.
struct Surroundings {
  Timeline& timeline;
  Network& network;
  const Plan& plan;
  testing::Random& random;
  std::function<void(const std::string&)> trace;  ///< each step, so that two runs can be compared
  Violation violation;
  std::function<void(const std::string&)> count;  ///< counts states that should occur sometimes
  /// An actor makes its operation of this number now.
  std::function<void(std::size_t actor, std::size_t operation)> did;
  /// The process that serves a partition, for its Node; null: there is none, or it hangs.
  std::function<std::shared_ptr<Process>(const std::string& partition)> serving;
  std::map<std::string, Instant> forgotten;  ///< partitions, and when somebody last forgot them
  bool handed_removed = false;  ///< the deputy has removed the frame that it had taken over
  /// For each of them, the partitions that have stored that, and when they stored which news of it.
  std::map<std::string, std::map<std::string, std::pair<std::int64_t, Instant>>> forgotten_by;
  Steps& steps;
  Invariants& invariants;
};

/// A process as a sender: its number is in the first eight bytes.
PeerId peer_of(std::uint64_t process);
std::uint64_t process_of(const PeerId& peer);

/// One process of a participant: the loops that it runs around its Member, in simulated time.
class Process : public std::enable_shared_from_this<Process>,
                public RequestLink,
                private Commits::Effects,
                private Pushes::Sink {
 public:
  /// What a life begins with.
  struct Setting {
    std::size_t host = 0;
    std::uint64_t id = 0;   ///< unique in a run
    std::string partition;  ///< empty: a client
    std::vector<FrameSpec> configured;
    Disk* disk = nullptr;          ///< null: nothing is stored
    const Clock* clock = nullptr;  ///< of its computer
  };

  Process(Surroundings& world, Setting setting);
  /// Begins, once it is in the network.
  void start();

  // ---- faults
  void pause() { ++pauses_; }
  /// Whether it hangs, or has hung after this instant.
  [[nodiscard]] bool hung_since(Instant then) const { return paused() || resumed_ >= then; }
  void resume();
  [[nodiscard]] bool paused() const { return pauses_ > 0; }
  /// Ends in order, and announces that.
  void leave();

  // ---- input from the network
  /// Runs now, or when the process is resumed.
  void run(std::function<void()> what);
  void met(std::uint64_t peer);
  void hear(std::uint64_t from, const Sample& sample);
  void on_request(std::uint64_t from, const Request& request);
  /// @param partition  of that process
  void on_reply(std::uint64_t from, const std::string& partition, const Reply& reply);
  /// @param number  the sender counts what it pushes
  void on_pushed(std::uint64_t from, std::uint64_t number, const PushedValues& pushed);
  /// Values of a stream.
  void on_update(const Update& update);
  void on_update(const JointUpdate& update);
  /// A participant listens to a group of watchers.
  void on_watcher(std::uint64_t group);

  // ---- calls
  /// @param what  for people
  void begin(const std::string& what, std::shared_ptr<Task> task, RunningCall::Then then);
  void begin(const std::string& what, RunningCall::Route route, RunningCall::Then then) {
    begin(what, RunningCall::change(std::move(route)), std::move(then));
  }
  [[nodiscard]] std::shared_ptr<LookupTask> lookup(const std::string& a, const std::string& b,
                                                   const Query& query = {}) {
    return std::make_shared<LookupTask>(forest_, ClockKind::kSystem, hints_,
                                        WantedLookup{a, b, query});
  }
  [[nodiscard]] ReplyTable& replies() { return replies_; }
  [[nodiscard]] SharedHints& hints() { return hints_; }
  /// The process that has replied to a request; 0: none
  [[nodiscard]] std::uint64_t replied_by(const Part& part) const;
  // RequestLink
  [[nodiscard]] Reply answer(const Request& request) override;
  [[nodiscard]] Result<void> send(const std::string& partition, const Request& request,
                                  TimeLimit::Clock::time_point until) override;
  /// Forgets an unreachable partition itself.
  [[nodiscard]] Result<void> forget(const std::string& partition);
  /// Reports when all earlier changes are stored, and whether that succeeded.
  void when_stored(std::function<void(const Result<void>&)> then);
  /// Sends values without a reply.
  template <class Values>
  void stream(const std::string& partition, const Values& update) {
    each_server(partition, [&](std::uint64_t peer) {
      world_.network.send(*this, peer, &update,
                          [update](Process& there) { there.on_update(update); });
    });
  }
  /// Watches a path while it has another holder.
  /// @param shown  called when its value may have changed
  void watch(const std::shared_ptr<WatchedPath>& path, std::function<void()> shown) {
    watches_.add(path, std::move(shown));
  }
  /// From now on it is told what may change its plan.
  void keep_planned(const std::shared_ptr<Planned>& planned) { planned_.push_back(planned); }
  /// Tells the owner of a partition that a group of watchers has one more member.
  void listen(const std::string& partition, std::uint64_t group);
  /// Whether frames that it does not know do not exist.
  [[nodiscard]] bool discovered() const;

  /// @param kind  a literal
  void later(const char* kind, Instant wait, std::function<void()> what);

  [[nodiscard]] std::uint64_t id() const { return setting_.id; }
  [[nodiscard]] std::size_t host() const { return setting_.host; }
  [[nodiscard]] const std::string& partition() const { return setting_.partition; }
  [[nodiscard]] bool serves_or_claims() const { return !setting_.partition.empty(); }
  [[nodiscard]] bool serves() const { return serving_; }
  [[nodiscard]] bool ended() const { return ended_; }
  /// Whether it has ended because a frame of its configuration is still another's.
  [[nodiscard]] bool came_too_early() const { return too_early_; }
  [[nodiscard]] std::vector<Sample> published() const;
  [[nodiscard]] Forest& forest() { return forest_; }
  [[nodiscard]] const Forest& forest() const { return forest_; }
  [[nodiscard]] Directory& directory() { return directory_; }
  [[nodiscard]] Member& member() { return member_; }
  [[nodiscard]] Surroundings& world() { return world_; }
  [[nodiscard]] Time wall() const { return setting_.clock->at(world_.timeline.now()); }
  /// Counts what has changed it.
  [[nodiscard]] std::uint64_t inputs() const { return inputs_; }
  /// The epoch of the stored structure; the greatest: nothing is stored.
  [[nodiscard]] std::uint64_t stored_epoch() const {
    return setting_.disk != nullptr ? setting_.disk->epoch() : ~0ULL;
  }
  /// Calls that have not ended, and changes that wait to be stored.
  [[nodiscard]] std::size_t open_calls() const;
  [[nodiscard]] const std::set<std::uint64_t>& pushed_groups() const { return pushed_groups_; }
  [[nodiscard]] const Watches& watches() const { return watches_; }
  /// Whether a frame of that partition counts.
  using Counts = std::function<bool(const std::string& frame, const std::string& owner)>;
  /// id, parent and partition of each frame that counts and whose owner is reachable; sorted.
  [[nodiscard]] std::vector<std::string> structure(const Counts& counts) const;

 private:
  struct Peer {
    std::optional<Presence> said;
    std::optional<Presence> by_page;
    Hearing heard{};
    std::optional<Instant> used{};  // something was sent to it
    bool silent = false;
    [[nodiscard]] const Presence* known() const {
      const bool later = by_page && said && by_page->incarnation > said->incarnation;
      if (said && !later) return &*said;
      return by_page ? &*by_page : nullptr;
    }
  };

  void reply_to(std::uint64_t peer, const Reply& reply);
  void answer_watch(std::uint64_t from, const Request& request);
  void push_by(Pushes::Clock::time_point time);
  // Pushes::Sink
  void push(const PushedValues& pushed) override;
  void end(std::uint64_t group) override { pushed_groups_.erase(group); }
  void wake() override;
  [[nodiscard]] Pushes::Clock::time_point now() const override { return world_.timeline.steady(); }

  void each_server(const std::string& partition, const std::function<void(std::uint64_t)>& tell);
  void tick();
  void look_for_silent();
  void tell_count(std::size_t heard);
  void look_at(std::uint64_t peer, Peer& known);
  void show_life(Peer& known);
  void react();
  void tell_planned(const Outcome& outcome);
  void count(const Outcome& outcome);
  void step_claim();
  void take_frames();
  void serve();
  [[nodiscard]] bool is_too_early(const Error& error) const;
  void look_at_commits();
  void commit();
  void perform(const Ready& ready);
  // Commits::Effects
  [[nodiscard]] Ready take(bool values_due) override;
  void publish(const Ready& ready) override;
  void take_back(const Ready& ready) override;
  void reply(const PendingReply& pending) override;

  void announce(const std::optional<Presence>& presence);
  void yield();
  [[nodiscard]] bool awaits_presence() const;

  Surroundings& world_;
  const Setting setting_;
  Forest forest_;
  Directory directory_;
  Member member_;
  std::optional<Claiming> claiming_;
  std::map<std::uint64_t, Peer> peers_;
  std::map<std::uint32_t, Page> pages_;  // as published last
  std::optional<Presence> presence_;
  ReplyTable replies_;
  std::vector<std::shared_ptr<RunningCall>> calls_;
  std::map<std::uint32_t, std::uint64_t> replied_;  // by whom, by the numbers of requests
  SharedHints hints_;
  std::vector<std::weak_ptr<Planned>> planned_;
  std::uint64_t told_structure_ = 0;
  Pushes pushes_;
  std::set<std::uint64_t> pushed_groups_;
  Pushes::Clock::time_point push_at_ = Pushes::kNever;
  Watches watches_;
  std::uint64_t pushed_ = 0;
  std::vector<std::function<void()>> backlog_;
  Commits commits_;
  Commits::Clock::time_point commit_at_ = Commits::kNever;
  std::list<std::pair<std::uint64_t, std::function<void(const Result<void>&)>>> waiting_;
  Instant born_{};
  Instant looked_{};
  std::uint64_t looks_ = 0;
  std::size_t told_count_ = 0;  // of others that are heard, with the presence
  Instant told_count_at_{};
  Instant resumed_{-1};
  std::uint64_t inputs_ = 0;
  int pauses_ = 0;
  bool serving_ = false;
  bool ended_ = false;
  bool too_early_ = false;
  bool committing_ = false;
  bool yielding_ = false;
  bool looking_for_gone_ = false;
};

}  // namespace tfdude::simulation
