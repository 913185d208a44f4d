#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "faults/cluster.hpp"
#include "faults/journal.hpp"
#include "faults/observer.hpp"
#include "faults/schedule.hpp"

namespace tfdude::faults {

/// Executes the faults of a schedule, and checks that no daemon ends by itself.
class Nemesis {
 public:
  Nemesis(Cluster& cluster, Observer& observer, Journal& journal)
      : cluster_(cluster), observer_(observer), journal_(journal) {}

  /// Returns when this many seconds have passed and all faults are over.
  void run(const std::vector<Fault>& faults, double seconds);

  /// Kills all daemons at once, and restarts them.
  void restart_all();

 private:
  void kill(std::size_t partition);
  void begin(const Fault& fault);
  void end(const Fault& fault);
  void note(const std::string& what, const Fault& fault);
  void start(std::size_t partition);
  void watch();
  void await_starts();
  [[nodiscard]] bool connected(std::size_t partition) const;

  Cluster& cluster_;
  Observer& observer_;
  Journal& journal_;
  std::multimap<double, Fault> endings_;
  std::set<std::size_t> starting_;
  std::multiset<std::size_t> cut_;  // partitions, by either kind of cut
};

}  // namespace tfdude::faults
