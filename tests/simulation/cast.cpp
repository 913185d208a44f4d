#include "simulation/cast.hpp"

namespace tfdude::simulation {

std::string extra_of(std::size_t owner) { return "extra_" + std::to_string(owner); }

std::string Cast::name_of_daemon(std::size_t owner) const {
  return owner == wild && renamed % 2 == 1 ? "renamed" : faults::partition_name(owner);
}

Process* Cast::find_daemon(const std::string& partition) const {
  for (const auto& daemon : daemons) {
    if (daemon && daemon->partition() == partition) return daemon.get();
  }
  return nullptr;
}

Cast::Standing Cast::standing(const std::string& partition) const {
  for (std::size_t i = 0; i < daemons.size(); ++i) {
    if (!daemons[i] || daemons[i]->partition() != partition) continue;
    // With a full disk it cannot start again.
    const bool serves = daemons[i]->serves() && !daemons[i]->ended();
    const bool stuck = standings[i] == Standing::kAside && !serves;
    return stuck ? Standing::kOut : standings[i];
  }
  return Standing::kOut;
}

}  // namespace tfdude::simulation
