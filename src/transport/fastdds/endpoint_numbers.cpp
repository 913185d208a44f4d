#include "transport/fastdds/endpoint_numbers.hpp"

#include <utility>

namespace tfdude::fastdds {

EndpointNumbers::Id EndpointNumbers::created(std::function<void()> announce) {
  const Lock lock(mutex_);
  const Id id = ++last_id_;
  numbers_.emplace(id, next_);
  endpoints_.emplace(next_, Endpoint{id, std::move(announce)});
  ++next_;
  return id;
}

void EndpointNumbers::deleted(Id endpoint) {
  if (endpoint == kNone) return;
  Lock lock(mutex_);
  announced_.wait(lock, [&]() TFDUDE_REQUIRES(mutex_) { return announcing_ != endpoint; });
  const auto known = numbers_.find(endpoint);
  if (known == numbers_.end()) return;
  endpoints_.erase(known->second);
  numbers_.erase(known);
  ++next_;
}

void EndpointNumbers::tidy() {
  Lock lock(mutex_);
  while (count_unused() > kMostUnused) {
    auto oldest = endpoints_.extract(endpoints_.begin());
    oldest.key() = next_++;
    const auto renewed = endpoints_.insert(std::move(oldest)).position;
    const Endpoint& endpoint = renewed->second;
    numbers_[endpoint.id] = renewed->first;
    announcing_ = endpoint.id;
    const auto announce = endpoint.announce;
    lock.unlock();
    announce();
    lock.lock();
    announcing_ = kNone;
    announced_.notify_all();
  }
}

std::uint64_t EndpointNumbers::unused() const {
  const Lock lock(mutex_);
  return count_unused();
}

std::uint64_t EndpointNumbers::count_unused() const {
  if (endpoints_.empty()) return 0;
  return endpoints_.rbegin()->first - endpoints_.begin()->first + 1 - endpoints_.size();
}

}  // namespace tfdude::fastdds
