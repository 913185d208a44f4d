#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "simulation/actor.hpp"

namespace tfdude::simulation {

/// A client that writes two edges of its own in one commit, by a request, a stream, or a Node of
/// their owner, moves them from base to base, and
/// continuously reads them by a watched path. Each value must be one that was written, of one
/// commit, in a place where the frames were, and never older than an earlier value while their
/// owner lives.
class Follower final : public Actor {
 public:
  /// @param actor  the number by which its operations are counted
  /// @param owners  whose partitions it uses; none of them is renamed
  Follower(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
           std::size_t owners);

  /// A partition has lost some of its stored changes.
  void lost_power(const std::string& partition);

  [[nodiscard]] std::size_t added() const override {
    return 2 * static_cast<std::size_t>(generation_);
  }
  /// The owner of both edges; empty: it has none.
  [[nodiscard]] const std::string& partition() const { return partition_; }
  [[nodiscard]] std::string arm() const { return id("arm"); }
  [[nodiscard]] std::string tip() const { return id("tip"); }
  [[nodiscard]] bool watches() const { return watch_ != nullptr; }
  [[nodiscard]] Result<StampedTransform> read() const;

 private:
  /// One value of both edges.
  struct Written {
    std::set<std::size_t> bases;  // below which it may have been
    bool replaced = false;        // for sure
  };

  void step() override;
  [[nodiscard]] std::string title() const override { return tip(); }
  void restart();
  void add_tip();
  void write();
  void request(std::size_t value);
  void stream(std::size_t value);
  void write_here(std::size_t value);
  void written(std::size_t value);
  [[nodiscard]] std::vector<EdgeUpdate> both(std::size_t value) const;
  void move();
  void begin(const std::string& what, RunningCall::Route route, Then then);
  void look();
  void judge(const StampedTransform& X);
  void forget_order_after_restart();
  void may_be_older();
  void moving_to(std::size_t base);
  [[nodiscard]] std::string id(const char* which) const;
  [[nodiscard]] bool may_be_lost() const { return lost_ >= began_; }

  const std::size_t number_;
  std::shared_ptr<WatchedPath> watch_;
  std::string partition_;
  bool arm_added_ = false;        // and not the tip yet
  int generation_ = 0;            // of the two frames
  std::set<std::size_t> bases_;   // below which they may be now
  std::set<std::size_t> ever_;    // below which they may have been
  std::vector<Written> written_;  // by the number of the value
  std::size_t newest_read_ = 0;
  std::optional<std::size_t> shown_base_;
  std::uint64_t incarnation_ = 0;  // of the owner
  bool may_go_back_ = false;       // once, since the owner was started again
  std::size_t applied_ = 0;        // the newest value that the owner is known to have
  std::size_t stored_ = 0;         // of these, the newest that it is known to have stored
  std::size_t floor_ = 0;          // what it had stored when it was last started again
  Instant began_{};                // of the current operation
  Instant lost_{-1};               // when its owner last lost changes
};

}  // namespace tfdude::simulation
