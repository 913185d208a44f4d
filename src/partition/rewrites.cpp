#include "partition/rewrites.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "partition/shares.hpp"

namespace tfdude {

Result<std::optional<std::vector<EdgeSample>>> Rewrites::add(const PeerId& from,
                                                             const std::string& id,
                                                             const RewriteRequest& part, Time now) {
  if (part.total > kMaxRewritten) {
    return fail(Errc::kTooMuch, "frame " + quote(id) + ": " + std::to_string(part.total) +
                                    " samples to rewrite, of at most " +
                                    std::to_string(kMaxRewritten) + " at once");
  }
  const Key key(from, part.number);
  const bool is_last = part.first + part.samples.size() == part.total;
  auto known = begun_.find(key);
  if (known == begun_.end()) {
    // Nothing is kept beyond the last part.
    auto room = is_last ? Result<void>() : make_room(from, id);
    if (!room) return tl::unexpected(std::move(room.error()));
    known = begun_.emplace(key, Begun{id, part.interval, part.total, now, {}, {}, 0}).first;
  }
  Begun& begun = known->second;
  if (!fits(begun, id, part)) {
    begun_.erase(known);
    return fail(Errc::kInvalidInput,
                "frame " + quote(id) + ": a part of its rewrite does not fit the others");
  }
  begun.heard = now;
  put(begun, part);
  const bool is_whole = begun.samples.size() == begun.total;
  if (!is_whole && !is_last) return std::nullopt;
  std::vector<EdgeSample> all = std::move(begun.samples);
  begun_.erase(known);
  if (is_whole) return all;
  return fail(
      Errc::kChangedMeanwhile,
      "frame " + quote(id) + ": its owner does not have all parts of its rewrite (any more)");
}

Result<void> Rewrites::make_room(const PeerId& from, const std::string& id) {
  if (count_of(begun_, from) >= kMostOfOne) {
    return fail(Errc::kTooMuch, "frame " + quote(id) + ": this participant has begun " +
                                    std::to_string(kMostOfOne) +
                                    " other rewrites here, its share of the limit");
  }
  if (make_room_for(begun_, from, kMost)) return {};
  return fail(Errc::kTooMuch, "frame " + quote(id) + ": " + std::to_string(kMost) +
                                  " others are being rewritten, the limit");
}

// Also that no more is kept than there may be in all.
bool Rewrites::fits(const Begun& begun, const std::string& id, const RewriteRequest& part) {
  const bool same = begun.id == id && begun.total == part.total &&
                    begun.interval.from == part.interval.from &&
                    begun.interval.to == part.interval.to;
  const std::size_t size = part.samples.size();
  if (!same || size == 0 || part.first > part.total || size > part.total - part.first) return false;
  return begun.samples.size() + begun.ahead + size <= part.total + kMostRewrittenAtOnce;
}

void Rewrites::put(Begun& begun, const RewriteRequest& part) {
  if (part.first > begun.samples.size()) {
    if (begun.further.emplace(part.first, part.samples).second) begun.ahead += part.samples.size();
    return;
  }
  const auto add = [&](const std::vector<EdgeSample>& samples, std::uint32_t first) {
    const std::size_t known = begun.samples.size() - first;
    if (known >= samples.size()) return;
    begun.samples.insert(begun.samples.end(), samples.begin() + static_cast<std::ptrdiff_t>(known),
                         samples.end());
  };
  add(part.samples, part.first);
  for (auto next = begun.further.begin();
       next != begun.further.end() && next->first <= begun.samples.size();
       next = begun.further.erase(next)) {
    add(next->second, next->first);
    begun.ahead -= next->second.size();
  }
}

// A clock that is set back does not keep one for ever.
void Rewrites::forget_idle(Time now) {
  for (auto one = begun_.begin(); one != begun_.end();) {
    const Time heard = one->second.heard;
    const bool idle = std::max(now, heard) - std::min(now, heard) > kIdle;
    one = idle ? begun_.erase(one) : std::next(one);
  }
}

}  // namespace tfdude
