#include "transport/fastdds/number_bounds.hpp"

#include <algorithm>
#include <cstring>

namespace tfdude::fastdds {
namespace {

using Kind = NumberClaim::Kind;

constexpr std::size_t kWays = 4;  // places at which a key can be

// RTPS 2.2, 9.3.1.2.
bool is_of_discovery(const NumberClaim::Entity& entity) { return (entity[3] & 0xC0U) == 0xC0U; }

std::uint64_t first_limit(const NumberClaim& claim) {
  return is_of_discovery(claim.writer) ? NumberBounds::kFirstOfDiscovery : NumberBounds::kFirst;
}

}  // namespace

NumberBounds::Key NumberBounds::key_of(const NumberClaim& claim) {
  Key key;
  std::memcpy(&key.begin, claim.sender.data(), 8);
  std::uint32_t low = 0;
  std::uint32_t high = 0;
  std::memcpy(&low, claim.sender.data() + 8, 4);
  std::memcpy(&high, claim.writer.data(), 4);
  key.end = std::uint64_t{high} << 32U | low;
  return key;
}

NumberBounds::Key NumberBounds::key_of_own(NumberClaim claim) {
  claim.sender = {};
  return key_of(claim);
}

// The places at which a key can be. An attacker who fills them only makes room for himself: whoever
// is forgotten has the limits of a new one.
NumberBounds::Entry* NumberBounds::places(Table& table, const Key& key) {
  constexpr std::uint64_t kOdd = 0x9E3779B97F4A7C15U;
  const std::uint64_t mixed = ((key.begin ^ key.end * kOdd) * kOdd) >> 32U;
  return &table[mixed % (kRoom / kWays) * kWays];
}

NumberBounds::Entry* NumberBounds::find(Table& table, const Key& key) {
  Entry* const first = places(table, key);
  Entry* const found =
      std::find_if(first, first + kWays, [&](const Entry& entry) { return entry.key == key; });
  return found != first + kWays ? found : nullptr;
}

NumberBounds::Entry& NumberBounds::make(Table& table, const Key& key) {
  Entry* const first = places(table, key);
  Entry& oldest = *std::min_element(
      first, first + kWays, [](const Entry& a, const Entry& b) { return a.heard < b.heard; });
  oldest = {};
  oldest.key = key;
  return oldest;
}

bool NumberBounds::admit(const NumberClaim& claim, Clock::time_point now) {
  const Key key = key_of(claim);
  const Lock lock(mutex_);
  if (claim.kind == Kind::kAcknowledgement) return admit_acknowledged(claim);
  Entry* entry = find(heard_, key);
  if (entry == nullptr) {
    if (claim.last > first_limit(claim)) return false;
    entry = &make(heard_, key);
  } else if (claim.last > entry->reached + kLongestRange) {
    const std::chrono::duration<double> silence = now - entry->heard;
    const auto more = static_cast<std::uint64_t>(std::max(0.0, silence.count()) * kPerSecond);
    if (claim.last > entry->reached + kLongestRange + more) return false;
  }
  if (!admit_kind(*entry, claim)) return false;
  entry->reached = std::max(entry->reached, claim.last);
  entry->heard = std::max(entry->heard, now);
  return true;
}

// Nobody has received what was not sent. The same writer is meant, whoever acknowledges.
bool NumberBounds::admit_acknowledged(const NumberClaim& claim) {
  if (claim.first <= 1) return true;
  const Entry* const sent = find(sent_, key_of_own(claim));
  return claim.first <= (sent != nullptr ? sent->reached + 1 + kUnannounced : first_limit(claim));
}

bool NumberBounds::admit_kind(Entry& entry, const NumberClaim& claim) {
  switch (claim.kind) {
    case Kind::kHeartbeat:
      if (claim.last < entry.existing) {  // another process with the same GUID
        entry.existing = 0;
        entry.count = 0;
      }
      // Fast DDS ignores one that was overtaken.
      if (claim.count <= entry.count && entry.existing > 0) return true;
      entry.count = claim.count;
      entry.existing = std::max(entry.existing, claim.first);
      return true;
    case Kind::kGap:
      if (entry.existing == 0) entry.existing = claim.first;
      return claim.last < entry.existing + kLongestRange;
    case Kind::kFragments:
      return !is_of_discovery(claim.writer) || claim.sample_bytes <= kLargestOfDiscovery;
    default:
      return true;
  }
}

// Heartbeats are rare, so a count of them is time enough to find the oldest.
void NumberBounds::send(const NumberClaim& heartbeat) {
  const Lock lock(mutex_);
  const Key key = key_of_own(heartbeat);
  Entry* entry = find(sent_, key);
  if (entry == nullptr) entry = &make(sent_, key);
  entry->reached = std::max(entry->reached, heartbeat.last);
  entry->heard = Clock::time_point(Clock::duration(++heartbeats_));
}

}  // namespace tfdude::fastdds
