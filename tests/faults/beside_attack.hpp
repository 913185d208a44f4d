#pragma once

#include <cstddef>

namespace tfdude::faults {

/// Runs a robot of two daemons, an honest client that looks up and changes frames, and beside them
/// one attacker after the other. Nothing that was acknowledged may be lost, the daemons must live,
/// answer and keep to a bound of memory; how long the client waits is printed.
/// @param seconds  for each kind of attack
/// @param secured  the robot and the attacker have keys; the attacker's may only look
/// @return the exit status
[[nodiscard]] int run_attacks(double seconds, bool secured);

}  // namespace tfdude::faults
