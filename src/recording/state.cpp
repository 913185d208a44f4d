#include "recording/state.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/assembly.hpp"
#include "partition/routing.hpp"

namespace tfdude::recording {
namespace {

// Of all edges together, about 400 bytes each.
constexpr std::size_t kMostSamples = 2'000'000;
constexpr std::size_t kLeastSamples = 64;
constexpr std::size_t kMostOfOneEdge = 65'536;

// Frames of a damaged file that wait for others to move; more of them stay roots.
constexpr std::size_t kMostCut = 1000;

// The frames of another process come at once with the news that its partition is reachable. If
// nothing comes for so long, it is the same process.
constexpr std::chrono::seconds kSameAfter{1};

EdgeTiming unlimited(std::size_t edges) {
  EdgeTiming timing;
  timing.span = std::chrono::hours(24 * 365 * 50);
  timing.count =
      std::clamp(kMostSamples / std::max<std::size_t>(edges, 1), kLeastSamples, kMostOfOneEdge);
  timing.max_ahead = std::chrono::nanoseconds::max();
  timing.restart_after = 0;
  return timing;
}

}  // namespace

State::State() { (void)forest_.set_default_timing(unlimited(1)); }

// Edges that are not dynamic yet get fewer samples if there are more of them.
void State::share_memory() {
  if (owners_.size() < shared_by_ + shared_by_ / 8 + 1) return;
  shared_by_ = owners_.size();
  (void)forest_.set_default_timing(unlimited(shared_by_));
}

State::Known& State::partition(const std::string& name) {
  Known& known = partitions_[name];
  known.info.name = name;
  return known;
}

// Each owner's frames are in one message. All that change their parent are detached before one is
// attached, as a frame and the one below it may change places.
// @param begins  of another process, which has other values
void State::put(Known& known, const std::vector<WatchedFrame>& frames, bool begins) {
  std::vector<const WatchedFrame*> detached;
  for (const WatchedFrame& frame : frames) {
    if (detach(known, frame, begins)) detached.push_back(&frame);
  }
  share_memory();
  for (const WatchedFrame* frame : detached) {
    // A damaged file may name it twice.
    if (known.frames.at(frame->id) == frame->parent) attach(*frame);
  }
}

// Notes an edge. @return whether it is another one than before: then its frame is nowhere
bool State::detach(Known& known, const WatchedFrame& frame, bool begins) {
  std::string& owner = owners_[frame.id];
  if (owner != known.info.name) {
    if (const auto other = partitions_.find(owner); other != partitions_.end()) {
      other->second.places.clear();
      other->second.frames.erase(frame.id);
    }
    owner = known.info.name;
  }
  const auto [noted, fresh] = known.frames.emplace(frame.id, frame.parent);
  const bool moved = std::exchange(noted->second, frame.parent) != frame.parent;
  known.places.clear();
  settled_.clear();
  if (!fresh && !moved && !begins) return false;
  (void)forest_.release(frame.id);
  cut_.erase(frame.id);
  if (!frame.parent.empty()) valueless_.insert(frame.id);
  return true;
}

void State::attach(const WatchedFrame& frame) {
  const auto added =
      forest_.add(frame.id, frame.parent, Transform(), Forest::MissingParent::kAllow);
  if (added || added.error().code != Errc::kCycle) return;
  (void)forest_.add(frame.id, "", Transform());
  if (cut_.size() < kMostCut) cut_.emplace(frame.id, frame.parent);
}

// Connects frames whose recorded parents were below them.
void State::mend() {
  for (auto cut = cut_.begin(); cut != cut_.end();) {
    cut = forest_.attach(cut->first, cut->second) ? cut_.erase(cut) : std::next(cut);
  }
}

void State::drop(Known& known, const std::string& id) {
  const auto owner = owners_.find(id);
  if (owner == owners_.end() || owner->second != known.info.name) return;
  owners_.erase(owner);
  known.places.clear();
  settled_.clear();
  known.frames.erase(id);
  valueless_.erase(id);
  cut_.erase(id);
  (void)forest_.release(id);
}

FramesNews State::frames_of(const Known& known) {
  FramesNews news;
  news.incarnation = known.incarnation;
  for (const auto& [id, parent] : known.frames) news.frames.push_back({id, parent});
  return news;
}

void State::apply(const RecordedMessage& message) {
  frames_changed_ = false;
  if (const auto* frames = std::get_if<RecordedFrames>(&message.what)) {
    apply(*frames, message.log);
  } else if (const auto* values = std::get_if<RecordedValues>(&message.what)) {
    apply(*values, message.foreign);
  } else if (const auto* joints = std::get_if<RecordedJoints>(&message.what)) {
    partition(joints->partition).joints = joints->joints;
  }
}

void State::apply(const RecordedFrames& frames, Time log) {
  Known& known = partition(frames.partition);
  if (frames.repeats && std::exchange(known.has_state, true)) return;
  known.has_state = true;
  const bool begins = frames.complete && frames.incarnation != known.incarnation;
  if (known.info.reachable != frames.reachable) known.info.since = log;
  if (begins || !frames.reachable) {
    known.returned.reset();
  } else if (!known.info.reachable && !known.frames.empty()) {
    known.returned = log;
  }
  known.info.reachable = frames.reachable;
  known.why = frames.why;
  known.incarnation = frames.incarnation;
  std::vector<std::string> gone = frames.removed;
  if (frames.complete) {
    std::unordered_set<std::string_view> stay;
    for (const WatchedFrame& frame : frames.frames) stay.insert(frame.id);
    for (const auto& [id, parent] : known.frames) {
      if (stay.count(id) == 0) gone.push_back(id);
    }
  }
  for (const std::string& id : gone) drop(known, id);
  put(known, frames.frames, begins);
  mend();
  frames_changed_ = frames.complete || !frames.frames.empty() || !gone.empty();
  known.info.frames = known.frames.size();
}

std::optional<Handle> State::settled(const Known& known, const RecordedEdge& edge) const {
  const bool is = edge.number < settled_.size() && settled_[edge.number].partition == &known;
  return is ? std::optional(settled_[edge.number].frame) : std::nullopt;
}

void State::settle(const Known& known, const RecordedEdge& edge, Handle handle) {
  if (settled_.size() <= edge.number) settled_.resize(edge.number + std::size_t{1});
  settled_[edge.number] = {&known, handle};
}

// Of an edge to which a value comes. None: it is not known here, or the value only repeats what is.
std::optional<Handle> State::edge_of(Known& known, const RecordedEdge& edge, bool repeats,
                                     bool foreign) {
  // One that only repeats is needed if nothing was known.
  if (repeats && valueless_.count(edge.id) == 0) return std::nullopt;
  const auto frame = known.frames.find(edge.id);
  if (frame == known.frames.end() || frame->second != edge.parent) {
    if (!foreign) return std::nullopt;
    if (!forest_.exists(edge.parent)) put(known, {WatchedFrame{edge.parent, ""}});
    put(known, {edge});
    frames_changed_ = true;
  }
  return forest_.find(edge.id);
}

void State::apply(const RecordedValues& recorded, bool foreign) {
  Known& known = partition(recorded.partition);
  if (!recorded.repeats) known.returned.reset();
  known.info.reachable = known.info.reachable || foreign;
  if (!take_samples(known, recorded)) take_values(known, recorded, foreign);
  known.info.frames = known.frames.size();
}

// Most messages only have samples of edges that are known. @return whether this is one
bool State::take_samples(const Known& known, const RecordedValues& recorded) {
  if (recorded.repeats) return false;
  samples_.clear();
  for (const RecordedValue& one : recorded.values) {
    const auto frame = settled(known, *one.edge);
    if (!frame || !one.is_sample()) return false;
    samples_.push_back({*frame, nanoseconds(*one.stamp), &one.X_PC});
  }
  forest_.take(samples_);
  return true;
}

void State::take_values(Known& known, const RecordedValues& recorded, bool foreign) {
  std::vector<Handle> edges;
  std::vector<PushedValue> values;
  for (const RecordedValue& one : recorded.values) {
    const RecordedEdge& edge = *one.edge;
    auto frame = settled(known, edge);
    bool first = false;
    if (frame && recorded.repeats) continue;
    if (!frame) {
      frame = edge_of(known, edge, recorded.repeats, foreign);
      if (!frame) continue;
      first = valueless_.erase(edge.id) > 0;
      settle(known, edge, *frame);
    }
    PushedValue& value = values.emplace_back();
    value.index = static_cast<std::uint32_t>(edges.size());
    value.stamp = one.stamp;
    value.X = one.X_PC;
    value.cleared = one.cleared;
    value.unsampled = one.unsampled;
    if (one.rest) {
      value.correlation = one.rest->correlation;
      value.process_noise = one.rest->begins;
      value.kept_before = one.rest->kept_before;
      value.drifts = one.rest->drifts;
    }
    if (first && !value.process_noise) value.process_noise = Covariance();
    edges.push_back(*frame);
  }
  forest_.take(edges, values);
}

PartitionNews State::news_of(const RecordedValues& recorded, Known& known) {
  if (known.places.empty()) {
    for (const auto& [id, parent] : known.frames) {
      known.places.emplace(id, static_cast<std::uint32_t>(known.places.size()));
    }
  }
  ValuesNews news{recorded.commit, {}};
  for (const RecordedValue& one : recorded.values) {
    const auto frame = known.frames.find(one.edge->id);
    if (frame == known.frames.end() || frame->second != one.edge->parent) continue;
    news.values.push_back(one.watched(known.places.at(one.edge->id)));
  }
  return {recorded.partition, std::move(news)};
}

std::vector<PartitionNews> State::news_of(const RecordedMessage& message) {
  std::vector<PartitionNews> news;
  if (const auto* frames = std::get_if<RecordedFrames>(&message.what)) {
    const Known& known = partition(frames->partition);
    if (frames->repeats && !frames_changed_) return news;
    news.push_back({frames->partition, ReachNews{frames->reachable, frames->why}});
    if (frames_changed_) news.push_back({frames->partition, frames_of(known)});
  } else if (const auto* values = std::get_if<RecordedValues>(&message.what)) {
    Known& known = partition(values->partition);
    if (frames_changed_) news.push_back({values->partition, frames_of(known)});
    if (!values->repeats) news.push_back(news_of(*values, known));
  }
  return news;
}

std::optional<Lost> State::lost(const std::vector<FrameInfo>& edges) const {
  for (const FrameInfo& edge : edges) {
    const auto found = partitions_.find(owner(edge.id));
    if (found == partitions_.end() || found->second.info.reachable) continue;
    const auto& [name, known] = *found;
    const std::string why =
        known.why.empty() ? "partition " + quote(name) + " is not reachable" : known.why;
    Lost lost{name, known.incarnation, {Errc::kUnreachable, why}, {}};
    for (const FrameInfo& one : edges) {
      if (owner(one.id) == name) lost.frames.push_back(one.id);
    }
    return lost;
  }
  return std::nullopt;
}

std::optional<Lost> State::lost(std::string_view a, std::string_view b) const {
  const auto edges = forest_.edges(a, b);
  return edges ? lost(*edges) : std::nullopt;
}

Returned State::returned(const Lost& lost, Time now) const {
  const auto is_taken = [&](const std::string& frame) {
    const std::string taker = owner(frame);
    return !taker.empty() && taker != lost.partition;
  };
  if (std::any_of(lost.frames.begin(), lost.frames.end(), is_taken)) return Returned::kAsOther;
  const auto found = partitions_.find(lost.partition);
  if (found == partitions_.end()) return Returned::kNo;
  const Known& known = found->second;
  if (known.incarnation != lost.incarnation) return Returned::kAsOther;
  if (!known.info.reachable) return Returned::kNo;
  return known.returned && now - *known.returned < kSameAfter ? Returned::kPerhaps : Returned::kYes;
}

// Whose parents decide how two frames are connected. Those that are missing for it are among them.
std::unordered_set<std::string> State::path_frames(std::string_view a, std::string_view b) const {
  std::unordered_set<std::string> frames;
  if (const auto edges = forest_.edges(a, b)) {
    for (const FrameInfo& edge : *edges) frames.insert(edge.id);
    return frames;
  }
  for (const std::string_view end : {a, b}) {
    for (std::string id(end); !id.empty() && frames.insert(id).second;) {
      // One that was cut waits for those above it to move, but not for itself.
      if (cut_.count(id) > 0) return {id};
      const auto info = forest_.info(id);
      id = info ? info->parent : std::string();
    }
  }
  return frames;
}

bool State::changes_path(const RecordedMessage& message, std::string_view a, std::string_view b,
                         Time known_by) const {
  const auto* news = std::get_if<RecordedFrames>(&message.what);
  if (news == nullptr) return false;
  const auto found = partitions_.find(news->partition);
  const Known* known = found != partitions_.end() ? &found->second : nullptr;
  if (news->repeats && known != nullptr && known->has_state) return false;
  const bool first = known == nullptr || known->incarnation == 0;
  const bool was_there = first && (known != nullptr ? known->info.since : message.log) <= known_by;
  const bool begins = news->complete && !(known && news->incarnation == known->incarnation);
  const auto frames = path_frames(a, b);
  std::unordered_set<std::string_view> stay;
  for (const WatchedFrame& frame : news->frames) {
    stay.insert(frame.id);
    if (frames.count(frame.id) == 0) continue;
    const std::string owner = this->owner(frame.id);
    if (owner.empty() && was_there) continue;
    if (owner != news->partition || begins || known->frames.at(frame.id) != frame.parent) {
      return true;
    }
  }
  const std::unordered_set<std::string_view> removed(news->removed.begin(), news->removed.end());
  const auto goes = [&](const std::string& id) {
    const bool is_left_out = news->complete && stay.count(id) == 0;
    return (is_left_out || removed.count(id) > 0) && owner(id) == news->partition;
  };
  return std::any_of(frames.begin(), frames.end(), goes);
}

// As the owners answered and the caller put it together, because to fourth order that matters.
Result<StampedTransform> State::lookup(std::string_view a, std::string_view b,
                                       const Query& query) const {
  const auto edges = forest_.edges(a, b);
  if (!edges) return tl::unexpected(edges.error());
  if (auto lost = this->lost(*edges)) return tl::unexpected(std::move(lost->error));
  for (const FrameInfo& edge : *edges) {
    if (valueless_.count(edge.id) == 0) continue;
    return fail(Errc::kNotYet, "frame " + quote(edge.id) + " has no value yet");
  }
  LookupPlan plan;
  LookupRequest request;
  request.query = query;
  // The state is that of then.
  request.query.believed_at.reset();
  for (const PathSegment& segment : segments(*edges, a)) {
    plan.segments.push_back({kHeldHere, segment.from, segment.to});
    request.segments.push_back({segment.from, segment.to});
  }
  if (request.segments.empty()) return assemble(plan, {});
  auto values = forest_.lookup_segments(request.segments, request.query);
  if (!values) return tl::unexpected(std::move(values.error()));
  plan.parts.push_back({kHeldHere, {}, Request{0, {}, std::move(request)}});
  return assemble(plan, {*std::move(values)});
}

std::vector<PathSegment> State::segments(const std::vector<FrameInfo>& edges,
                                         std::string_view from) const {
  std::vector<PathSegment> path;
  std::string at(from);
  for (const FrameInfo& edge : edges) {
    const std::string partition = owner(edge.id);
    if (path.empty() || path.back().partition != partition) path.push_back({partition, at, at});
    at = edge.id == at ? edge.parent : edge.id;
    path.back().to = at;
  }
  return path;
}

std::string State::owner(const std::string& frame) const {
  const auto found = owners_.find(frame);
  return found != owners_.end() ? found->second : std::string();
}

std::vector<Frame> State::frames() const {
  std::vector<Frame> frames;
  for (FrameInfo& info : forest_.frames()) {
    std::string partition = owner(info.id);
    frames.push_back(
        {std::move(info.id), std::move(info.parent), std::move(partition), info.attached});
  }
  std::sort(frames.begin(), frames.end(),
            [](const Frame& a, const Frame& b) { return a.id < b.id; });
  return frames;
}

std::vector<PartitionInfo> State::partitions() const {
  std::vector<PartitionInfo> all;
  for (const auto& [name, known] : partitions_) all.push_back(known.info);
  return all;
}

const std::vector<JointInfo>* State::joints(const std::string& partition) const {
  const auto found = partitions_.find(partition);
  return found != partitions_.end() ? &found->second.joints : nullptr;
}

std::vector<PartitionNews> State::news() const {
  std::vector<PartitionNews> all;
  for (const auto& [name, known] : partitions_) {
    all.push_back({name, ReachNews{known.info.reachable, known.why}});
    all.push_back({name, frames_of(known)});
    std::vector<EdgeCursor> cursors;
    std::vector<std::uint32_t> places;
    std::uint32_t place = 0;
    for (const auto& [id, parent] : known.frames) {
      if (!parent.empty() && valueless_.count(id) == 0) {
        cursors.push_back({id, parent});
        places.push_back(place);
      }
      ++place;
    }
    ValuesNews values;
    for (PushedValue& value : forest_.values_since(cursors, {true, {}, false, true}).values) {
      values.values.push_back({places[value.index],
                               value.stamp,
                               value.X,
                               std::move(value.correlation),
                               value.process_noise,
                               value.cleared,
                               value.unsampled,
                               {},
                               value.drifts});
    }
    all.push_back({name, std::move(values)});
  }
  return all;
}

}  // namespace tfdude::recording
