#include "tfdude/recording/recording.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/routing.hpp"
#include "recording/reading.hpp"
#include "tree/over_fixed.hpp"
#include "types/trajectory_builder.hpp"

namespace tfdude {
namespace {

using namespace recording;

// The samples of an edge. Late ones are counted, but do not divide a gap.
struct Gaps {
  std::size_t samples = 0;
  std::optional<Time> oldest;
  std::optional<Time> newest;
  std::size_t count = 0;
  double sum = 0;
  double squares = 0;
  std::chrono::nanoseconds greatest{0};

  void add(Time stamp) {
    ++samples;
    if (!oldest || stamp < *oldest) oldest = stamp;
    if (newest && stamp <= *newest) return;
    if (newest) {
      const std::chrono::nanoseconds gap = stamp - *newest;
      const auto ns = static_cast<double>(gap.count());
      ++count;
      sum += ns;
      squares += ns * ns;
      greatest = std::max(greatest, gap);
    }
    newest = stamp;
  }

  [[nodiscard]] HistoryInfo info(const std::string& id) const {
    HistoryInfo info;
    info.id = id;
    info.samples = samples;
    info.count_limit = samples;
    info.oldest = oldest;
    info.newest = newest;
    info.span_limit = *newest - *oldest;
    info.max_gap = greatest;
    if (count == 0) return info;
    const double mean = sum / static_cast<double>(count);
    const double variance = squares / static_cast<double>(count) - mean * mean;
    info.mean_gap = std::chrono::nanoseconds(std::llround(mean));
    info.jitter = std::chrono::nanoseconds(std::llround(std::sqrt(std::max(variance, 0.0))));
    return info;
  }
};

// Of all messages; nothing if there are none.
struct Span {
  std::optional<Time> first;
  std::optional<Time> last;
};

Span span_of(const Cursor& cursor) {
  Span span;
  for (const ChunkPlace& chunk : cursor.reader().chunks()) {
    const Time start = checked_time(chunk.start);
    const Time end = checked_time(chunk.end);
    span.first = std::min(span.first.value_or(start), start);
    span.last = std::max(span.last.value_or(end), end);
  }
  return span;
}

bool is_same_way(const std::vector<EdgeFromFixed>& one, const std::vector<EdgeFromFixed>& other) {
  return std::equal(
      one.begin(), one.end(), other.begin(), other.end(),
      [](const EdgeFromFixed& a, const EdgeFromFixed& b) { return a.id == b.id && a.up == b.up; });
}

// Of edges that are on both ways, if the way to the earlier instant is not to be had any more in
// the state of the later one: what has no history was all the time as it is by then.
void take_what_rests(const std::vector<EdgeFromFixed>& later, std::vector<EdgeFromFixed>& earlier) {
  for (EdgeFromFixed& edge : earlier) {
    const auto same = std::find_if(later.begin(), later.end(),
                                   [&](const EdgeFromFixed& one) { return one.id == edge.id; });
    const bool rests = same != later.end() && !same->moving && !edge.moving;
    if (rests && same->up == edge.up) edge.X_PC = same->X_PC;
  }
}

}  // namespace

class Recording::Impl {
 public:
  explicit Impl(Cursor cursor)
      : span_(span_of(cursor)),
        reading_(std::move(cursor), span_.first.value_or(Time{}), span_.last.value_or(Time{})) {}

  [[nodiscard]] std::vector<RecordedNews> next() {
    while (const RecordedMessage* message = reading_.step()) {
      std::vector<RecordedNews> all;
      for (PartitionNews& news : reading_.news_of(*message)) {
        all.push_back({message->log, std::move(news)});
      }
      if (!all.empty()) return all;
    }
    return {};
  }

  // Calls a function for all messages of a topic, and of foreign files for all messages, from a
  // place before an instant on, until it returns false. Then restores the instant that is shown.
  template <class Visit>
  void visit(std::optional<Topic> only, Time from, Visit visit) {
    Cursor& cursor = reading_.cursor();
    cursor.rewind();
    if (only) cursor.only(*only);
    while (const RecordedMessage* message = cursor.next()) {
      if (message->log >= from && !visit(*message)) break;
    }
    cursor.all_topics();
    reading_.load_again();
  }

  void read_all() {
    Cursor& cursor = reading_.cursor();
    cursor.rewind();
    while (cursor.next() != nullptr) {
    }
    counts_ = cursor.counts();
    reading_.load_again();
  }

  [[nodiscard]] Reading& reading() { return reading_; }
  [[nodiscard]] const std::optional<TransformCounts>& counts() const { return counts_; }
  [[nodiscard]] const State& state() const { return reading_.state(); }
  [[nodiscard]] const Cursor& cursor() const { return reading_.cursor(); }
  [[nodiscard]] std::optional<Time> start() const { return span_.first; }
  [[nodiscard]] std::optional<Time> end() const { return span_.last; }

 private:
  const Span span_;
  Reading reading_;
  std::optional<TransformCounts> counts_;  // if all was read
};

Recording::Recording(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;
Recording::~Recording() = default;

Result<Recording> Recording::open(const std::string& file) {
  auto source = open_source(file);
  if (!source) return tl::unexpected(std::move(source.error()));
  auto cursor = Cursor::open(*std::move(source));
  if (!cursor) return fail_at(quote(file), cursor.error());
  return Recording(std::make_unique<Impl>(*std::move(cursor)));
}

Result<Recording> Recording::read(std::string_view bytes) {
  auto cursor = Cursor::open(std::make_unique<TextSource>(bytes));
  if (!cursor) return tl::unexpected(std::move(cursor.error()));
  return Recording(std::make_unique<Impl>(*std::move(cursor)));
}

RecordingSummary Recording::summary() const {
  const Cursor& cursor = impl_->cursor();
  const McapReader& reader = cursor.reader();
  const auto& counts = impl_->counts();
  return {reader.library(),
          cursor.foreign(),
          reader.finished(),
          impl_->start(),
          impl_->end(),
          reader.size(),
          reader.chunks().size(),
          reader.message_count(),
          cursor.problems(),
          counts ? std::optional(counts->left_out()) : std::nullopt,
          counts};
}

void Recording::read_all() { impl_->read_all(); }

void Recording::seek(Time at) { impl_->reading().seek(at); }
Time Recording::instant_for(Time stamp) const { return impl_->reading().instant_for(stamp); }
Time Recording::instant() const { return impl_->reading().instant(); }
bool Recording::step() { return impl_->reading().step() != nullptr; }

Result<StampedTransform> Recording::lookup(std::string_view a, std::string_view b,
                                           const Query& query) {
  if (query.believed_at) seek(*query.believed_at);
  return impl_->reading().lookup(a, b, query);
}

Result<StampedTransform> Recording::lookup_at(std::string_view a, std::string_view b, Time at,
                                              const Query& query, Milliseconds wait) {
  if (query.believed_at) {
    Query then = query;
    then.at = at;
    return lookup(a, b, then);
  }
  return impl_->reading().lookup_at(a, b, query, at, wait);
}

Result<StampedTransform> Recording::lookup_at(std::string_view a, Time at_a, std::string_view b,
                                              Time at_b, std::string_view fixed,
                                              const Query& query) {
  const auto edges_to = [&](std::string_view frame, Time at, const StampedTransform& X) {
    Query then = query;
    then.at = X.stamp.value_or(at);
    then.believed_at.reset();  // that is the state
    return edges_from_fixed(impl_->state().forest(), fixed, frame, then);
  };
  const bool a_is_later = at_a > at_b;
  const auto& [first, at_first] = a_is_later ? std::tie(b, at_b) : std::tie(a, at_a);
  const auto& [second, at_second] = a_is_later ? std::tie(a, at_a) : std::tie(b, at_b);
  auto X_F1 = lookup_at(fixed, first, at_first, query);
  if (!X_F1) return X_F1;
  auto to_first = edges_to(first, at_first, *X_F1);
  if (!to_first) return tl::unexpected(std::move(to_first.error()));
  auto X_F2 = lookup_at(fixed, second, at_second, query);
  if (!X_F2) return X_F2;
  auto to_second = edges_to(second, at_second, *X_F2);
  if (!to_second) return tl::unexpected(std::move(to_second.error()));
  // Both ways are of the later state, in which the past may have been rewritten.
  auto by_now = edges_to(first, at_first, *X_F1);
  if (by_now && is_same_way(*by_now, *to_first)) {
    to_first = std::move(by_now);
  } else {
    take_what_rests(*to_second, *to_first);
  }
  if (a_is_later) {
    return over_fixed(*X_F2, *X_F1, *std::move(to_second), *std::move(to_first), query.order);
  }
  return over_fixed(*X_F1, *X_F2, *std::move(to_first), *std::move(to_second), query.order);
}

Trajectory Recording::trajectory(std::string_view a, std::string_view b,
                                 const std::vector<Time>& instants, const Query& query,
                                 Milliseconds wait) {
  if (!query.believed_at) return impl_->reading().trajectory(a, b, instants, query, wait);
  TrajectoryBuilder answers(instants.size());
  for (std::size_t i = 0; i < instants.size(); ++i) {
    answers.add(i, lookup_at(a, b, instants[i], query));
  }
  return std::move(answers).take();
}

Result<std::vector<PathSegment>> Recording::path(std::string_view a, std::string_view b) const {
  const auto edges = impl_->state().forest().edges(a, b);
  if (!edges) return tl::unexpected(edges.error());
  return impl_->state().segments(*edges, a);
}

Result<std::string> Recording::parent(const std::string& id) const {
  const auto info = impl_->state().forest().info(id);
  if (!info) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
  return info->parent;
}

Result<std::vector<std::string>> Recording::children(const std::string& id) const {
  return impl_->state().forest().children(id);
}

std::vector<std::string> Recording::roots() const { return impl_->state().forest().roots(); }
bool Recording::exists(const std::string& id) const { return impl_->state().forest().exists(id); }
std::vector<Frame> Recording::frames() const { return impl_->state().frames(); }
std::vector<PartitionInfo> Recording::partitions() const { return impl_->state().partitions(); }

Result<std::vector<JointInfo>> Recording::joints(const std::string& partition) const {
  const auto* joints = impl_->state().joints(partition);
  if (joints == nullptr) return fail_without_partition(partition);
  return *joints;
}

Result<std::vector<HistoryInfo>> Recording::histories(const std::string& partition) const {
  if (impl_->state().joints(partition) == nullptr) {
    return fail_without_partition(partition);
  }
  std::vector<HistoryInfo> all;
  for (HistoryInfo& history : impl_->state().forest().histories()) {
    if (impl_->state().owner(history.id) == partition) all.push_back(std::move(history));
  }
  return all;
}

Result<std::vector<HistoryInfo>> Recording::history(const std::string& id) {
  Gaps gaps;
  bool found = exists(id);
  impl_->visit(std::nullopt, Time::min(), [&](const RecordedMessage& message) {
    const auto* values = std::get_if<RecordedValues>(&message.what);
    if (values == nullptr || values->repeats) return true;
    for (const RecordedValue& value : values->values) {
      if (value.edge->id != id) continue;
      found = true;
      if (value.stamp) gaps.add(*value.stamp);
    }
    return true;
  });
  if (!found) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
  if (!gaps.newest) return std::vector<HistoryInfo>();
  return std::vector<HistoryInfo>{gaps.info(id)};
}

void Recording::events(Time from, const std::function<bool(const Change&)>& visit) {
  impl_->visit(Topic::kEvents, from, [&](const RecordedMessage& message) {
    const auto* change = std::get_if<Change>(&message.what);
    return change == nullptr || visit(*change);
  });
}

std::vector<PartitionNews> Recording::state() const { return impl_->state().news(); }
std::vector<RecordedNews> Recording::next() { return impl_->next(); }

}  // namespace tfdude
