#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "partition/messages.hpp"
#include "simulation/network.hpp"
#include "simulation/timeline.hpp"

namespace tfdude::simulation {

class Process;

/// Reports a state that is not allowed.
/// @param kind  the rule that is broken: two runs that break the same one fail in the same way
using Violation = std::function<void(const std::string& kind, const std::string& what)>;

/// The rules that hold after each event of a run, whoever it concerns:
///
/// - The incarnation of a process only grows, and no other process of its partition ever has it.
/// - What a process knows of a partition that it hears only grows: incarnation and epoch.
/// - No frame is below itself, and an owner publishes exactly the frames that it holds.
/// - Nobody hears of what is not stored: no page, and no reply to a change.
/// - A Node sees its changes at once.
/// - A streamed value that arrives at the owner of its edge is the edge's value, unless it has a
///   stamp.
/// - Each call ends by its deadline.
class Invariants {
 public:
  explicit Invariants(Violation violation) : violation_(std::move(violation)) {}

  /// An event has ended that concerned this process.
  void after(Process& one);
  /// An event has ended.
  void after(Instant now);

  /// A call that must have ended by then, unless its process has ended or hung.
  /// @param over  whether it has
  void called(const std::shared_ptr<Process>& caller, std::function<bool()> over,
              const std::string& what, Instant must_end);

  /// What a process is about to publish.
  void publishes(const Process& one, const Sample& sample);
  /// A process has answered a request of its Node.
  void answered(const Process& one, const Request& request, const Reply& reply);
  /// A process has got these streamed values.
  void streamed(const Process& one, const Update& update);
  /// What a process is about to reply to a request that may have changed something.
  void replies(const Process& one, const Reply& reply);

 private:
  struct Heard {
    std::uint64_t incarnation = 0;  // 0: it is not heard
    std::uint64_t epoch = 0;
    bool may_fall = true;  // once: when the pages of this incarnation replace those before
  };
  struct Known {
    std::uint64_t inputs = ~0ULL;
    std::uint64_t structure = ~0ULL;
    std::uint64_t incarnation = 0;
    std::vector<Heard> others;                         // by their numbers
    std::map<std::uint32_t, std::uint64_t> published;  // epochs, by page
  };
  struct Call {
    std::weak_ptr<Process> caller;
    std::function<bool()> over;
    std::string what;
  };

  void check_incarnation(Process& one, Known& known);
  void check_heard(Process& one, Known& known);
  void check_structure(Process& one);

  const Violation violation_;
  std::map<std::uint64_t, Known> known_;                                    // by process
  std::map<std::pair<std::string, std::uint64_t>, std::uint64_t> numbers_;  // processes
  std::multimap<Instant, Call> calls_;                                      // by when they must end
};

}  // namespace tfdude::simulation
