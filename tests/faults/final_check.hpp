#pragma once

#include <memory>
#include <string>
#include <vector>

#include "faults/cluster.hpp"
#include "faults/journal.hpp"
#include "faults/worker.hpp"

namespace tfdude::faults {

/// Runs after the last fault. Waits until the workers' clients, an observer and two new clients see
/// the same frames, and these agree with the models; then looks all of them up. If that does not
/// happen in time, it is a violation.
void check_all(const std::string& when, Cluster& cluster, Client& observer,
               const std::vector<std::unique_ptr<Worker>>& workers, Journal& journal);

}  // namespace tfdude::faults
