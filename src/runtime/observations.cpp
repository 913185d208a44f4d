#include "runtime/observations.hpp"

#include <unistd.h>
#include <utility>

#include "runtime/wall_clock.hpp"

namespace tfdude {

Result<Observed> Observations::determine(const std::string& id, const Measurement& measured,
                                         const Deadline& deadline) {
  if (auto ok = check_finite(measured.X_AB); !ok) return fail_at("the measurement", ok.error());
  std::string source = std::string(kObservedPrefix) + std::to_string(nanoseconds(wall_clock())) +
                       "." + std::to_string(getpid()) + "." + std::to_string(++count_);
  ObserveTask task(structure_.forest, measured, id, std::move(source), settled(),
                   requests_.on_demand() != nullptr, deadline);
  auto applied = requests_.run(task, deadline);
  if (!applied) return tl::unexpected(std::move(applied.error()));
  settle(task.source());
  return std::move(task.observed());
}

std::vector<std::string> Observations::settled() const {
  const Lock lock(mutex_);
  return {settled_.begin(), settled_.end()};
}

void Observations::settle(std::string source) {
  const Lock lock(mutex_);
  settled_.push_back(std::move(source));
  if (settled_.size() > kMostSettled) settled_.pop_front();
}

Result<std::vector<EdgeConsistency>> Observations::consistency(const std::string& partition) {
  return requests_.ask_all<EdgeConsistency>(partition, ConsistencyRequest{true},
                                            discovery_.call_deadline());
}

}  // namespace tfdude
