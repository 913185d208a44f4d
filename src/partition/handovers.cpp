#include "partition/handovers.hpp"

#include <algorithm>
#include <iterator>

#include "tfdude/base/id.hpp"

#include "partition/shares.hpp"

namespace tfdude {
namespace {

std::size_t bytes_of(const Correlation& correlation) {
  std::size_t bytes = 64;
  for (const CommonError& one : correlation.common_errors) {
    bytes += 32 + one.source.size() + 8 * static_cast<std::size_t>(one.loading.size());
  }
  for (const std::string& id : correlation.observed_with) bytes += 8 + id.size();
  return bytes;
}

}  // namespace

std::size_t bytes_of(const HandedSample& sample) {
  constexpr std::size_t kTransform = 28 * 8 + 32;
  return kTransform + (sample.revision ? kTransform + bytes_of(sample.revision->correlation) : 0);
}

std::size_t bytes_of_head(const HandedEdge& edge) {
  return 512 + edge.id.size() + edge.parent.size() + bytes_of(edge.said) +
         bytes_of(edge.now.value_or(Correlation()));
}

tl::unexpected<Error> being_handed_over(const std::string& id) {
  return fail(Errc::kNotOwner, "frame " + quote(id) + " is being handed over to another partition");
}

Result<std::optional<std::vector<HandedEdge>>> AdoptedParts::add(const PeerId& from,
                                                                 const std::string& top,
                                                                 const HandedPart& part, Time now) {
  forget_idle(now);
  const std::pair key(from, top);
  if (part.begins) begun_.erase(key);
  if (begun_.count(key) == 0) {
    if (auto room = make_room(from, top); !room) return tl::unexpected(std::move(room.error()));
  }
  Begun& begun = begun_[key];
  if (part.begins) {
    begun.incarnation = part.incarnation;
    if (!part.edges.empty()) begun.lamport_time = part.edges.front().lamport_time;
  }
  begun.heard = now;
  if (auto ok = put(begun, top, part); !ok) {
    begun_.erase(key);
    return tl::unexpected(std::move(ok.error()));
  }
  if (!part.is_last) return std::nullopt;
  std::vector<HandedEdge> all = std::move(begun.edges);
  begun_.erase(key);
  return all;
}

Result<void> AdoptedParts::make_room(const PeerId& from, const std::string& top) {
  if (make_room_for(begun_, from, kMost)) return {};
  return fail(Errc::kTooMuch, "frame " + quote(top) + ": " + std::to_string(kMost) +
                                  " others are being handed over to this partition, the limit");
}

Result<void> AdoptedParts::put(Begun& begun, const std::string& top, const HandedPart& part) const {
  auto& edges = begun.edges;
  const bool continues = !edges.empty() && edges.back().continues;
  const std::size_t first = edges.size() - (continues ? 1 : 0);
  const bool fits =
      begun.incarnation == part.incarnation && part.first == first && !part.edges.empty() &&
      (!continues || part.edges.front().id == edges.back().id) &&
      std::all_of(part.edges.begin(), part.edges.end(),
                  [&](const HandedEdge& one) { return one.lamport_time == begun.lamport_time; });
  if (!fits) {
    return fail(Errc::kChangedMeanwhile,
                "frame " + quote(top) + ": parts of what is known of it are missing");
  }
  for (const HandedEdge& edge : part.edges) {
    begun.samples += edge.samples.size();
    begun.bytes += bytes_of_head(edge);
    for (const HandedSample& sample : edge.samples) begun.bytes += bytes_of(sample);
  }
  std::size_t bytes = 0;
  for (const auto& [key, one] : begun_) bytes += one.bytes;
  if (first + part.edges.size() > kMaxItems || begun.samples > kMostHandedSamples ||
      bytes > kMostBytes) {
    return fail(Errc::kTooMuch, "frame " + quote(top) + ": too many frames or samples");
  }
  auto next = part.edges.begin();
  if (continues) {
    auto& samples = edges.back().samples;
    samples.insert(samples.end(), next->samples.begin(), next->samples.end());
    edges.back().continues = next->continues;
    ++next;
  }
  edges.insert(edges.end(), next, part.edges.end());
  const auto open =
      std::find_if(edges.begin(), edges.end(), [](const HandedEdge& one) { return one.continues; });
  const bool is_whole = open == edges.end() || (std::next(open) == edges.end() && !part.is_last);
  if (is_whole) return {};
  return fail(Errc::kChangedMeanwhile,
              "frame " + quote(top) + ": samples of frame " + quote(open->id) + " are missing");
}

// A clock that is set back does not keep one for ever.
void AdoptedParts::forget_idle(Time now) {
  for (auto one = begun_.begin(); one != begun_.end();) {
    const Time heard = one->second.heard;
    const bool idle = std::max(now, heard) - std::min(now, heard) > kIdle;
    one = idle ? begun_.erase(one) : std::next(one);
  }
}

}  // namespace tfdude
