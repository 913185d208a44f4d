#include "simulation/disk.hpp"

#include <cstddef>
#include <utility>

namespace tfdude::simulation {

void Disk::put(Instant now, std::function<void(Disk&)> apply) {
  apply(*this);
  if (!sync_) journal_.push_back({now, std::move(apply)});
}

Result<void> Disk::save(const StateChange& rows, Instant now) {
  if (full_) return fail(Errc::kState, "the disk is full");
  if (rows.empty()) return {};
  put(now, [rows](Disk& disk) {
    disk.epoch_ = rows.epoch;
    (void)disk.store_.save(rows);
  });
  return {};
}

void Disk::checkpoint() {
  synced_ = store_;
  synced_epoch_ = epoch_;
  journal_.clear();
}

std::optional<Instant> Disk::lose_power(testing::Random& random) {
  if (journal_.empty()) return std::nullopt;
  const std::size_t kept = random.index(journal_.size() + 1);
  const auto changes = std::exchange(journal_, {});
  store_ = synced_;
  epoch_ = synced_epoch_;
  for (std::size_t i = 0; i < kept; ++i) changes[i].apply(*this);
  checkpoint();
  if (kept == changes.size()) return std::nullopt;
  return changes[kept].when;
}

}  // namespace tfdude::simulation
