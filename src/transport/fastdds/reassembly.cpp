#include "transport/fastdds/reassembly.hpp"

#include <algorithm>
#include <utility>

namespace tfdude::fastdds {
namespace {

// What a sample takes beside the bytes of its datagrams.
constexpr std::size_t kOverhead = 256;

}  // namespace

std::vector<Reassembly::Datagram> Reassembly::take(const NumberClaim& claim, Datagram datagram,
                                                   Clock::time_point now) {
  const Key key{claim.sender, claim.writer, claim.first, claim.sample_bytes, claim.fragment_bytes};
  const Lock lock(mutex_);
  if (conflicts(key)) return {};
  Part& part = part_of(key);
  bool is_new = false;
  const std::size_t end = std::min<std::size_t>(part.has.size(), claim.fragment - 1 + claim.many);
  for (std::size_t i = claim.fragment - 1; i < end; ++i) {
    if (part.has[i]) continue;
    part.has[i] = true;
    --part.missing;
    is_new = true;
  }
  if (!is_new) return {};
  part.at = now;
  part.grown = ++count_;
  // One that has more fragments from the same one on replaces the other.
  Datagram& place = part.datagrams[claim.fragment];
  part.bytes += datagram.size() - place.size();
  bytes_ += datagram.size() - place.size();
  place = std::move(datagram);
  const bool is_only = part.datagrams.size() == 1;
  std::vector<Datagram> whole;
  if (part.missing == 0) {
    for (auto& [first, one] : part.datagrams) whole.push_back(std::move(one));
    drop(parts_.find(key));
    if (complete_.size() < kKnown) {
      complete_.push_back(key);
    } else {
      complete_[next_++ % kKnown] = key;
    }
  }
  if (is_only || bytes_ > kMostBytes) make_room(key, now);
  return whole;
}

// Whether another sample of this number was complete before.
bool Reassembly::conflicts(const Key& key) const {
  return std::any_of(complete_.begin(), complete_.end(), [&](const Key& one) {
    return one.sender == key.sender && one.writer == key.writer && one.number == key.number &&
           (one.sample != key.sample || one.each != key.each);
  });
}

Reassembly::Part& Reassembly::part_of(const Key& key) {
  const auto [found, is_new] = parts_.try_emplace(key);
  Part& part = found->second;
  if (is_new) {
    part.missing = (key.sample + std::size_t{key.each} - 1) / key.each;
    part.has.resize(part.missing);
    part.bytes = kOverhead + part.missing / 8;
    bytes_ += part.bytes;
  }
  return part;
}

void Reassembly::make_room(const Key& but, Clock::time_point now) {
  const auto oldest_of = [](Parts::iterator begin, Parts::iterator end) {
    return std::min_element(
        begin, end, [](const auto& x, const auto& y) { return x.second.grown < y.second.grown; });
  };
  const auto from = parts_.lower_bound({but.sender, but.writer, 0, 0, 0});
  const auto to = parts_.upper_bound({but.sender, but.writer, ~std::uint64_t{0}, ~std::uint32_t{0},
                                      static_cast<std::uint16_t>(~0U)});
  if (static_cast<std::size_t>(std::distance(from, to)) > kOfWriter) drop(oldest_of(from, to));
  while (bytes_ > kMostBytes || parts_.size() > kMost)
    drop(oldest_of(parts_.begin(), parts_.end()));
  if (parts_.empty()) return;
  const auto oldest = oldest_of(parts_.begin(), parts_.end());
  if (now - oldest->second.at > kPatience) drop(oldest);
}

void Reassembly::drop(Parts::iterator part) {
  bytes_ -= part->second.bytes;
  parts_.erase(part);
}

std::size_t Reassembly::bytes() const {
  const Lock lock(mutex_);
  return bytes_;
}

}  // namespace tfdude::fastdds
