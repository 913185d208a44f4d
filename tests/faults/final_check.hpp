#pragma once

#include <memory>
#include <string>
#include <vector>

#include "faults/cluster.hpp"
#include "faults/journal.hpp"
#include "faults/worker.hpp"

namespace tfdude::faults {

/// Once all is quiet: waits until the workers' clients, an observer and two new clients see the
/// same frames, and those that the models say are there; then looks all of them up. What does not
/// come true in time is a violation.
void check_all(const std::string& when, Cluster& cluster, Client& observer,
               const std::vector<std::unique_ptr<Worker>>& workers, Journal& journal);

}  // namespace tfdude::faults
