#include "transport/fastdds/endpoint_sets.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "transport/fastdds/outgoing.hpp"
#include "transport/fastdds/rtps_layout.hpp"

namespace tfdude::fastdds {
namespace {

// A submessage of a vendor (RTPS 2.2, 9.4.5.1.1), which others ignore: its header, a mark, and the
// sum, the least byte first.
constexpr std::array<std::uint8_t, 8> kBegin{0xD7, rtps::kLittleEndian, 12, 0, 't', 'f', 'd', 'u'};
constexpr std::size_t kSumSize = 8;

}  // namespace

// A bijection whose values are as good as random (splitmix64).
std::uint64_t EndpointSets::number_of(const Entity& endpoint) {
  std::uint64_t number = 0;
  for (const std::uint8_t byte : endpoint) number = number << 8U | byte;
  number += 0x9E3779B97F4A7C15U;
  number = (number ^ number >> 30U) * 0xBF58476D1CE4E5B9U;
  number = (number ^ number >> 27U) * 0x94D049BB133111EBU;
  return number ^ number >> 31U;
}

std::vector<std::uint8_t> EndpointSets::with_own(const std::uint8_t* announcement,
                                                 std::size_t size) const {
  std::vector<std::uint8_t> all;
  all.reserve(size + kBegin.size() + kSumSize);
  all.assign(announcement, announcement + size);
  all.insert(all.end(), kBegin.begin(), kBegin.end());
  const std::uint64_t sum = own_;
  for (unsigned at = 0; at < 64; at += 8) all.push_back(static_cast<std::uint8_t>(sum >> at));
  return all;
}

EndpointSets::Known& EndpointSets::known(const PeerId& peer) {
  if (known_.size() > kMost) {
    for (auto one = known_.begin(); one != known_.end();) {
      one = one->second.there ? std::next(one) : known_.erase(one);
    }
  }
  Known& known = known_[peer];
  known.there = true;
  return known;
}

void EndpointSets::found(const PeerId& peer) {
  const Lock lock(mutex_);
  (void)known(peer);
}

void EndpointSets::found(const PeerId& peer, const Entity& endpoint, std::uint64_t settings) {
  const Lock lock(mutex_);
  Known& of = known(peer);
  const auto [there, is_new] = of.endpoints.try_emplace(endpoint, settings);
  if (is_new && of.lost.count(endpoint) == 0) {
    of.sum += number_of(endpoint);
  } else if (is_new) {
    there->second.reset();
  } else if (there->second && *there->second != settings) {
    of.sum -= number_of(endpoint);
    of.changed = true;
    there->second.reset();
  }
}

void EndpointSets::lost(const PeerId& peer, const Entity& endpoint) {
  const Lock lock(mutex_);
  const auto of = known_.find(peer);
  if (of == known_.end()) return;
  const auto there = of->second.endpoints.find(endpoint);
  if (there == of->second.endpoints.end()) return;
  if (there->second) of->second.sum -= number_of(endpoint);
  of->second.endpoints.erase(there);
  if (of->second.lost.size() < kMostLost) of->second.lost.insert(endpoint);
}

bool EndpointSets::left(const PeerId& peer) {
  const Lock lock(mutex_);
  const auto of = known_.find(peer);
  if (of == known_.end()) return false;
  const bool anew = of->second.anew;
  Known gone;
  gone.there = false;
  gone.patience = of->second.patience;
  gone.discovered_anew = of->second.discovered_anew;
  of->second = std::move(gone);
  if (of->second.patience == 1) known_.erase(of);
  return anew;
}

bool EndpointSets::contradicts(const std::uint8_t* datagram, std::size_t size,
                               Clock::time_point now) {
  if (size < rtps::kHeader + kBegin.size() + kSumSize) return false;
  const std::uint8_t* const end = datagram + size;
  const std::uint8_t* const begin = end - kBegin.size() - kSumSize;
  if (!std::equal(kBegin.begin(), kBegin.end(), begin)) return false;
  if (!is_announcement(datagram, size)) return false;
  std::uint64_t sum = 0;
  for (std::size_t i = 1; i <= kSumSize; ++i) sum = sum << 8U | *(end - i);
  PeerId sender;
  std::copy_n(datagram + rtps::kPrefixAt, sender.size(), sender.begin());

  const Lock lock(mutex_);
  const auto found = known_.find(sender);
  if (found == known_.end() || !found->second.there) return false;
  Known& of = found->second;
  const std::uint64_t difference = sum - of.sum;
  if (difference == 0) {
    of.doubt.reset();
    of.lost.clear();
    of.changed = false;
    if (now - of.discovered_anew > kTrustedAfter * of.patience) of.patience = 1;
    return false;
  }
  if (!of.doubt || of.doubt->difference != difference) of.doubt = {difference, now};
  const bool contradiction = of.changed || !of.lost.empty();
  if (now - of.doubt->since < (contradiction ? kAfterLoss : kOtherwise) * of.patience) return false;
  of.doubt.reset();
  of.patience = std::min(2 * of.patience, kMostPatient);
  of.discovered_anew = now;
  of.anew = true;
  return true;
}

}  // namespace tfdude::fastdds
