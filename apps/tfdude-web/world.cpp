#include "world.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "tfdude/math/interpolate.hpp"

#include "rendering/whole_value.hpp"

namespace tfdude::web {
namespace {

constexpr std::chrono::seconds kKept{60};
// Of all edges together: some 80 bytes each.
constexpr std::size_t kMostSamples = 1'000'000;
constexpr std::size_t kMostSamplesOfEdge = 2000;

Transform transform_of(const Pose& pose, const std::shared_ptr<const StatedCovariance>& sigma) {
  return {pose, sigma ? *sigma : StatedCovariance()};
}

// The value at an instant between kept samples.
std::optional<Transform> value_at(const ShownFrame& frame, Time instant) {
  if (!frame.has_value) return std::nullopt;
  if (!frame.stamp) return transform_of(frame.pose, frame.covariance);
  const auto after = std::lower_bound(
      frame.past.begin(), frame.past.end(), instant,
      [](const ShownFrame::Sample& sample, Time time) { return sample.stamp < time; });
  if (after == frame.past.end()) return std::nullopt;
  const Transform X1 = transform_of(after->pose, after->covariance);
  if (after->stamp == instant) return X1;
  if (after == frame.past.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const auto share = [](std::chrono::nanoseconds part, std::chrono::nanoseconds all) {
    return static_cast<double>(part.count()) / static_cast<double>(all.count());
  };
  const double s = share(instant - before->stamp, after->stamp - before->stamp);
  return interpolate(transform_of(before->pose, before->covariance), X1, s);
}

}  // namespace

void World::receive(const PartitionNews& news) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Shown& partition = partitions_[news.partition];
  if (const auto* reach = std::get_if<ReachNews>(&news.what)) {
    partition.reachable = reach->reachable;
    partition.why = reach->why;
    rebuild();
  } else if (const auto* frames = std::get_if<FramesNews>(&news.what)) {
    take(partition, *frames);
    rebuild();
  } else {
    take(partition, std::get<ValuesNews>(news.what));
  }
}

void World::drop(const std::string& partition) {
  const std::lock_guard<std::mutex> lock(mutex_);
  partitions_.erase(partition);
  rebuild();
}

void World::take(Shown& partition, const FramesNews& news) {
  std::map<std::string, ShownFrame> before;
  before.swap(partition.frames);
  partition.order.clear();
  for (const WatchedFrame& frame : news.frames) {
    partition.order.push_back(frame.id);
    const auto found = before.find(frame.id);
    if (found != before.end() && found->second.parent == frame.parent) {
      partition.frames.insert(before.extract(found));
      continue;
    }
    ShownFrame& fresh = partition.frames[frame.id];
    fresh.id = frame.id;
    fresh.parent = frame.parent;
  }
}

void World::take(Shown& partition, const ValuesNews& news) {
  for (const WatchedValue& value : news.values) {
    if (value.frame >= partition.order.size()) continue;
    const auto found = partition.frames.find(partition.order[value.frame]);
    if (found != partition.frames.end()) keep(found->second, value);
  }
}

void World::keep(ShownFrame& frame, const WatchedValue& value) {
  if (value.begins) {
    const auto kept = [&](const ShownFrame::Sample& sample) {
      return value.kept_before && sample.stamp < *value.kept_before;
    };
    frame.past.erase(std::partition_point(frame.past.begin(), frame.past.end(), kept),
                     frame.past.end());
  }
  if (value.cleared) {
    frame.past.clear();
    frame.has_value = false;
    return;
  }
  const StatedCovariance sigma = whole(value).covariance;
  auto shared = frame.covariance && *frame.covariance == sigma
                    ? frame.covariance
                    : std::make_shared<const StatedCovariance>(sigma);
  if (value.stamp) {
    auto place = std::lower_bound(
        frame.past.begin(), frame.past.end(), *value.stamp,
        [](const ShownFrame::Sample& sample, Time time) { return sample.stamp < time; });
    const bool is_corrected = place != frame.past.end() && place->stamp == *value.stamp;
    if (!is_corrected) place = frame.past.emplace(place);
    *place = {*value.stamp, value.X_PC.pose, shared};
    const bool newest = std::next(place) == frame.past.end();
    while (frame.past.size() > most_past_ ||
           frame.past.back().stamp - frame.past.front().stamp > kKept) {
      frame.past.pop_front();
    }
    if (!newest) return;
  }
  if (shared != frame.covariance || frame.correlated == value.correlation.empty()) {
    frame.covariance_changed = picture_;
  }
  frame.has_value = true;
  frame.pose = value.X_PC.pose;
  frame.covariance = std::move(shared);
  frame.correlated = !value.correlation.empty();
  frame.stamp = value.stamp;
  frame.changed = picture_;
}

void World::rebuild() {
  ++structure_;
  all_.clear();
  owners_.clear();
  places_.clear();
  std::uint32_t owner = 0;
  for (auto& [name, partition] : partitions_) {
    for (auto& [id, frame] : partition.frames) {
      // Of two owners, the reachable one is shown: the other has not heard of it yet.
      const auto [place, is_new] = places_.emplace(id, static_cast<std::uint32_t>(all_.size()));
      if (is_new) {
        all_.push_back(&frame);
        owners_.push_back(owner);
      } else if (partition.reachable) {
        all_[place->second] = &frame;
        owners_[place->second] = owner;
      }
    }
    ++owner;
  }
  most_past_ = std::min(kMostSamplesOfEdge, kMostSamples / std::max<std::size_t>(all_.size(), 1));
  most_past_ = std::max<std::size_t>(most_past_, 2);
}

std::uint64_t World::end_picture() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return picture_++;
}

std::uint32_t World::structure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return structure_;
}

void World::number_structure(std::uint32_t structure) {
  const std::lock_guard<std::mutex> lock(mutex_);
  structure_ = structure;
}

std::optional<std::uint32_t> World::index_of(const std::string& id) const {
  const auto found = places_.find(id);
  return found == places_.end() ? std::nullopt : std::optional<std::uint32_t>(found->second);
}

nlohmann::json World::structure_json() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  nlohmann::json partitions = nlohmann::json::array();
  for (const auto& [name, partition] : partitions_) {
    partitions.push_back(
        {{"name", name}, {"reachable", partition.reachable}, {"why", partition.why}});
  }
  nlohmann::json frames = nlohmann::json::array();
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const auto parent = index_of(all_[i]->parent);
    const nlohmann::json place = parent ? nlohmann::json(*parent) : nlohmann::json(all_[i]->parent);
    frames.push_back({all_[i]->id, place, owners_[i]});
  }
  return {{"op", "structure"},
          {"version", structure_},
          {"partitions", std::move(partitions)},
          {"frames", std::move(frames)}};
}

Message World::values(std::uint64_t picture, Time now, bool past) const {
  Message message(Kind::kValues, structure_, now, past);
  for (std::uint32_t i = 0; i < all_.size(); ++i) {
    const ShownFrame& frame = *all_[i];
    if (frame.has_value && frame.changed > picture) message.add_value(i, frame.pose, frame.stamp);
  }
  return message;
}

Message World::covariances(std::uint64_t picture, Time now, bool past) const {
  Message message(Kind::kCovariances, structure_, now, past);
  for (std::uint32_t i = 0; i < all_.size(); ++i) {
    const ShownFrame& frame = *all_[i];
    if (frame.has_value && frame.covariance_changed > picture) {
      message.add_covariance(i, *frame.covariance, frame.correlated);
    }
  }
  return message;
}

std::string World::values_since(std::uint64_t picture, Time now) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Message message = values(picture, now, false);
  return message.count() == 0 ? std::string() : message.finish();
}

std::string World::covariances_since(std::uint64_t picture, Time now) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Message message = covariances(picture, now, false);
  return message.count() == 0 ? std::string() : message.finish();
}

std::vector<std::string> World::newest(Time now) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {values(0, now, true).finish(), covariances(0, now, true).finish()};
}

std::vector<std::string> World::at(Time instant) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Message values(Kind::kValues, structure_, instant, true);
  Message covariances(Kind::kCovariances, structure_, instant, true);
  for (std::uint32_t i = 0; i < all_.size(); ++i) {
    const ShownFrame& frame = *all_[i];
    const auto X_PC = value_at(frame, instant);
    if (!X_PC) continue;
    values.add_value(i, X_PC->pose, frame.stamp ? std::optional<Time>(instant) : std::nullopt);
    covariances.add_covariance(i, X_PC->covariance, frame.correlated);
  }
  std::vector<std::string> messages;
  messages.push_back(values.finish());
  messages.push_back(covariances.finish());
  return messages;
}

std::optional<std::pair<Time, Time>> World::span() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::optional<std::pair<Time, Time>> span;
  for (const ShownFrame* frame : all_) {
    if (frame->past.empty()) continue;
    const Time oldest = frame->past.front().stamp;
    const Time newest = frame->past.back().stamp;
    if (!span) span = {oldest, newest};
    span->first = std::min(span->first, oldest);
    span->second = std::max(span->second, newest);
  }
  return span;
}

void World::each_placed(const std::function<void(const PlacedFrame&, std::uint32_t)>& see) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::vector<std::uint32_t>> children(all_.size());
  std::vector<std::uint32_t> order;
  std::vector<PlacedFrame> placed(all_.size());
  for (std::uint32_t i = 0; i < all_.size(); ++i) {
    const auto parent = index_of(all_[i]->parent);
    placed[i] = {all_[i], parent ? std::int64_t{*parent} : -1, {}, i, !parent};
    if (parent) {
      children[*parent].push_back(i);
    } else {
      placed[i].X_RC = Transform::exact(Pose());
      order.push_back(i);
    }
  }
  for (std::size_t done = 0; done < order.size(); ++done) {
    const PlacedFrame& above = placed[order[done]];
    see(above, order[done]);
    for (const std::uint32_t child : children[order[done]]) {
      PlacedFrame& below = placed[child];
      below.root = above.root;
      below.known = above.known && below.frame->has_value;
      if (below.known) {
        below.X_RC = compose(above.X_RC, transform_of(below.frame->pose, below.frame->covariance));
      }
      order.push_back(child);
    }
  }
}

void World::each_changed(std::uint64_t picture,
                         const std::function<void(const ShownFrame&)>& see) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const ShownFrame* frame : all_) {
    if (frame->has_value && frame->changed > picture && !frame->parent.empty()) see(*frame);
  }
}

}  // namespace tfdude::web
