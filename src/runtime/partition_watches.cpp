#include "runtime/partition_watches.hpp"

#include <algorithm>
#include <utility>

namespace tfdude {
namespace {

// How often watches are renewed at their owners, twice within kWatchLease. A reply has all values.
constexpr Milliseconds kRenewEvery{2000};

// Interval of retries while values are missing.
constexpr Milliseconds kRetryAfter{50};

}  // namespace

PartitionWatches::PartitionWatches(Links links)
    : links_(std::move(links)),
      rounds_(kRenewEvery, kRetryAfter, [this](bool renew) { return attend_all(renew); }) {}

void PartitionWatches::stop() {
  rounds_.stop();
  std::vector<Followed> partitions;
  {
    const Lock lock(mutex_);
    partitions = std::exchange(partitions_, {});
  }
  for (const Followed& partition : partitions) partition->stop();
}

void PartitionWatches::add(std::shared_ptr<FollowedPartition> partition) {
  {
    const Lock lock(mutex_);
    partitions_.push_back(std::move(partition));
  }
  rounds_.ask();
}

void PartitionWatches::on_pushed(const PushedValues& pushed) {
  std::vector<Followed> partitions;
  {
    const Lock lock(mutex_);
    partitions = partitions_;
  }
  bool lacks = false;
  for (const Followed& partition : partitions) lacks = partition->take(pushed) || lacks;
  if (lacks) rounds_.lack();
}

bool PartitionWatches::attend_all(bool renew) {
  std::vector<Followed> partitions;
  {
    const Lock lock(mutex_);
    partitions_.erase(std::remove_if(partitions_.begin(), partitions_.end(),
                                     [](const Followed& one) { return one->stopped(); }),
                      partitions_.end());
    partitions = partitions_;
  }
  bool all_well = true;
  for (const Followed& partition : partitions) all_well = attend(partition, renew) && all_well;
  close_unused(partitions);
  return all_well;
}

bool PartitionWatches::attend(const Followed& partition, bool renew) {
  auto plan = links_.plan(*partition);
  if (!plan) {
    partition->interrupt(plan.error().message);
    return true;  // it is looked at again when it returns
  }
  if (!partition->follow(*plan) && !renew && !partition->lacks(Clock::now())) {
    return true;
  }
  std::vector<Part> parts;
  for (PartitionPlan::Group& group : plan->groups) {
    if (!open_.contains(group.id)) {
      if (auto opened = links_.open(partition->name(), group.id); !opened) {
        partition->interrupt(opened.error().message);
        return true;  // until the next renewal
      }
      open_.insert(group.id, Clock::now());
    }
    parts.push_back(std::move(group.part));
  }
  return parts.empty() || ask(partition, std::move(parts), partition->lacks_from());
}

bool PartitionWatches::ask(const Followed& partition, std::vector<Part> parts,
                           std::optional<Time> from) {
  for (Part& part : parts) std::get<WatchRequest>(part.request.body).from = from;
  for (const Reply& reply : links_.ask(parts)) {
    if (const auto* pushed = std::get_if<PushedValues>(&reply.body)) {
      (void)partition->take(*pushed);
      continue;
    }
    const auto* error = std::get_if<Error>(&reply.body);
    if (error == nullptr) continue;
    // More edges are correlated with others than an answer can have.
    if (error->code == Errc::kInvalidInput && partition->most() > kMaxCorrelated) {
      partition->ask_for_less();
    } else if (error->code == Errc::kNotPermitted || error->code == Errc::kTooMuch) {
      partition->interrupt(error->message);
      return true;  // until the next renewal
    }
  }
  return !partition->lacks(Clock::now());
}

void PartitionWatches::close_unused(const std::vector<Followed>& partitions) {
  std::set<std::uint64_t> used;
  for (const Followed& partition : partitions) {
    if (!partition->stopped()) used.merge(partition->groups(Clock::now()));
  }
  for (const std::uint64_t group : open_.take_unused(used, Clock::now())) links_.close(group);
}

}  // namespace tfdude
