#include "simulation/cast.hpp"

namespace tfdude::simulation {

std::string extra_of(std::size_t owner) { return "extra_" + std::to_string(owner); }
std::string spare_of(std::size_t owner) { return "spare_" + std::to_string(owner); }
std::string spare_joint_of(std::size_t owner) { return "spare_joint_" + std::to_string(owner); }

std::string extra_parent_of(std::size_t owner, const Configured& configured, std::size_t owners) {
  if (configured.extra_parent == 0) return faults::base_of(owner);
  return configured.extra_parent == 1 ? "world" : faults::base_of((owner + 1) % owners);
}

void Configured::change(std::size_t how) {
  if (how % 3 == 0) extra = !extra;
  if (how % 3 == 1) {
    extra_parent = (extra_parent + 1) % 3;
    extra = true;
  }
  if (how % 3 == 2 || how % 5 == 0) {
    spare = static_cast<Spare>((static_cast<std::size_t>(spare) + 1 + how % 2) % 3);
  }
}

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
