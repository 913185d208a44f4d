#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "simulation/actor.hpp"
#include "simulation/samples.hpp"

namespace tfdude::simulation {

/// A client that writes stamped samples of a frame of its own, by requests and by a stream, in
/// order and late, with a clock that jumps back; and that looks them up at instants, and watches
/// them.
class Sampler final : public Actor {
 public:
  /// @param actor  the number by which its operations are counted
  /// @param owners  whose partitions it uses; none of them is renamed
  Sampler(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
          std::size_t owners);

  [[nodiscard]] std::size_t added() const override { return generation_; }
  /// The owner of the frame; empty: it has none.
  [[nodiscard]] const std::string& partition() const { return partition_; }
  [[nodiscard]] std::string frame() const;
  /// Looks at the newest value, and at the last samples, in the end. There must be an answer.
  void look_back();
  /// The watch must have every sample that the owner has, of those in order that were sent since it
  /// began: an owner does not repeat late ones whose push was lost.
  void check_watch(const Forest& owner);

 private:
  void step() override;
  [[nodiscard]] std::string title() const override { return frame(); }
  void add();
  void write();
  void stream(std::size_t number);
  void request(std::size_t number);
  void look_up(std::optional<Time> at, bool last);
  void begin(const std::string& what, const std::shared_ptr<Task>& task, Then then);
  void see(double value);
  void watch();
  void look_at_watch();
  void check(const Samples::Broken& broken);
  [[nodiscard]] std::vector<EdgeUpdate> edge(std::size_t number) const;
  [[nodiscard]] Time any_instant();

  const std::size_t number_;
  Samples samples_;
  std::set<std::size_t> streamed_;  // their numbers
  std::shared_ptr<WatchedPath> watch_;
  std::set<std::uint64_t> shown_groups_;  // empty: it shows nothing
  std::size_t watched_from_ = 0;          // the first sample that was sent since
  bool late_ = false;                     // the current one
  std::string base_;
  std::string partition_;
  bool added_ = false;
  std::size_t generation_ = 0;  // of the frame
};

}  // namespace tfdude::simulation
