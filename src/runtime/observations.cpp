#include "runtime/observations.hpp"

#include <algorithm>
#include <unistd.h>
#include <utility>

#include "runtime/wall_clock.hpp"

namespace tfdude {

Result<Observed> Observations::determine(const std::string& id, const Measurement& measured,
                                         const Deadline& deadline) {
  if (auto ok = check_finite(measured.X_AB); !ok) return fail_at("the measurement", ok.error());
  std::string source = std::string(kObservedPrefix) + std::to_string(nanoseconds(wall_clock())) +
                       "." + std::to_string(getpid()) + "." + std::to_string(++count_);
  ObserveTask task(structure_.forest, measured, id, std::move(source), earlier(),
                   requests_.on_demand() != nullptr, deadline);
  auto applied = requests_.run(task, deadline);
  if (!applied) return tl::unexpected(std::move(applied.error()));
  note(task);
  return std::move(task.observed());
}

EarlierObservations Observations::earlier() const {
  const Lock lock(mutex_);
  return {{settled_.begin(), settled_.end()}, {rewritten_.begin(), rewritten_.end()}};
}

void Observations::note(const ObserveTask& done) {
  const Lock lock(mutex_);
  settled_.push_back(done.source());
  if (settled_.size() > kMostSettled) settled_.pop_front();
  for (const std::string& id : done.rewritten()) {
    if (std::find(rewritten_.begin(), rewritten_.end(), id) == rewritten_.end())
      rewritten_.push_back(id);
    if (rewritten_.size() > kMostRewritten) rewritten_.pop_front();
  }
}

Result<std::vector<EdgeConsistency>> Observations::consistency(const std::string& partition) {
  return requests_.ask_all<EdgeConsistency>(partition, ConsistencyRequest{true},
                                            discovery_.call_deadline());
}

}  // namespace tfdude
