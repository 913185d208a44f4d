#include "tfdude/recording/recording.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "tfdude/base/id.hpp"

#include "recording/path_appends.hpp"
#include "recording/state.hpp"
#include "tree/over_fixed.hpp"
#include "types/trajectory_builder.hpp"

namespace tfdude {
namespace {

using namespace recording;

// How much is read before an instant, at first: as much as live histories have.
constexpr std::chrono::seconds kHistory{10};
// If that was not enough, so many times more, and in the end all.
constexpr int kMore = 8;
constexpr std::chrono::nanoseconds kAll = std::chrono::hours(24 * 365);

// Whether later data may give an answer.
bool may_come(Errc code) {
  return code == Errc::kNotYet || code == Errc::kNotConnected || code == Errc::kUnreachable ||
         is_unknown(code);
}

// The owners that were not reachable while a lookup read on. If such a process returns, it has the
// data. Another one knows nothing of the instant, whatever it says holds for all times.
class Losses {
 public:
  // @return the error, if an owner was lost and another process has taken its place; or may have,
  // and then the lookup must read on
  [[nodiscard]] std::optional<Error> judge(const State& state, const std::optional<Lost>& lost,
                                           Time now, bool& ends) {
    const auto is_known = [&](const Lost& one) { return one.partition == lost->partition; };
    if (lost && std::none_of(lost_.begin(), lost_.end(), is_known)) lost_.push_back(*lost);
    for (const Lost& one : lost_) {
      const Returned returned = state.returned(one, now);
      ends = returned == Returned::kAsOther;
      if (ends || returned == Returned::kPerhaps) return one.error;
    }
    return std::nullopt;
  }

 private:
  std::vector<Lost> lost_;
};

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

Time before(Time at, std::chrono::nanoseconds span) {
  const std::int64_t ns = nanoseconds(at);
  return time_of(ns > span.count() ? ns - span.count() : 0);
}

}  // namespace

class Recording::Impl {
 public:
  explicit Impl(Cursor cursor) : cursor_(std::move(cursor)) {
    for (const ChunkPlace& chunk : cursor_.reader().chunks()) {
      const Time start = checked_time(chunk.start);
      const Time end = checked_time(chunk.end);
      start_ = std::min(start_.value_or(start), start);
      end_ = std::max(end_.value_or(end), end);
    }
    load(end_.value_or(Time{}), kHistory);
  }

  void seek(Time at) {
    if (at < now_) return load(at, kHistory);
    advance(at);
  }

  bool step() { return step_message().has_value(); }

  // A state that began too late is read again, from an earlier place.
  Result<StampedTransform> lookup(std::string_view a, std::string_view b, const Query& query) {
    while (true) {
      auto X_AB = state_->lookup(a, b, query);
      if (X_AB || cursor_.from_beginning() || span_ >= kAll) return X_AB;
      const bool too_late =
          X_AB.error().code == Errc::kTooOld || (cursor_.foreign() && may_come(X_AB.error().code));
      if (!too_late) return X_AB;
      load(now_, span_ * kMore);
    }
  }

  Result<StampedTransform> lookup_at(std::string_view a, std::string_view b, Query query, Time at,
                                     Milliseconds wait) {
    query.at = at;
    seek(at);
    Losses losses;
    while (true) {
      auto X_AB = lookup(a, b, query);
      bool ends = false;
      const bool unreachable = !X_AB && X_AB.error().code == Errc::kUnreachable;
      auto lost =
          losses.judge(*state_, unreachable ? state_->lost(a, b) : std::nullopt, now_, ends);
      if (lost) X_AB = tl::unexpected(*std::move(lost));
      if (X_AB || ends || !may_come(X_AB.error().code)) return X_AB;
      const auto next = cursor_.peek();
      if (!next || std::chrono::duration_cast<Milliseconds>(*next - at) > wait || !step()) {
        return X_AB;
      }
    }
  }

  // Each instant is looked up in the state that lookup_at() would find its answer in, or in one
  // that differs only by messages that append samples.
  Trajectory trajectory(std::string_view a, std::string_view b, const std::vector<Time>& instants,
                        Query query, Milliseconds wait) {
    constexpr std::size_t kAtOnce = 256;
    std::vector<std::size_t> order(instants.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t x, std::size_t y) { return instants[x] < instants[y]; });
    TrajectoryBuilder all(instants.size());
    if (instants.empty()) return std::move(all).take();
    seek(instants[order.front()]);
    PathAppends appends(a, b);
    appends.begin(*state_);
    std::size_t done = 0;
    // Answers what can be answered now, of what was asked before an instant. At the end: all.
    const auto answer = [&](Time before_this, bool ends = false) {
      std::optional<std::pair<Handle, Handle>> handles;  // once it is known that all have values
      for (; done < order.size() && (ends || instants[order[done]] < before_this); ++done) {
        query.at = instants[order[done]];
        if (handles && query.order == Order::kSecond) {
          const auto X_AB = state_->forest().lookup(handles->first, handles->second, query);
          if (X_AB) {
            all.add(order[done], X_AB);
            continue;
          }
        }
        const State* before = state_.get();
        const auto X_AB = lookup(a, b, query);
        if (state_.get() != before) appends.begin(*state_);
        const auto from = state_->forest().find(a);
        const auto to = state_->forest().find(b);
        if (X_AB && from && to) handles = {*from, *to};
        const bool late = now_ - *query.at > wait;
        if (!X_AB && may_come(X_AB.error().code) && X_AB.error().code != Errc::kUnreachable &&
            !late && !ends) {
          return;
        }
        all.add(order[done], X_AB);
      }
    };
    answer(now_ + std::chrono::nanoseconds(1));
    for (std::size_t since = 0; done < order.size(); ++since) {
      auto message = cursor_.next();
      if (!message) {
        answer({}, true);
        break;
      }
      const bool appended = appends.only_appends(*state_, *message);
      now_ = std::max(now_, message->log);
      if (!appended || since >= kAtOnce) {
        // A question at the time of the message comes after it.
        answer(message->log);
        since = 0;
      }
      state_->apply(*message);
      if (appended) continue;
      appends.begin(*state_);
      answer(message->log);
    }
    return std::move(all).take();
  }

  [[nodiscard]] std::vector<RecordedNews> next() {
    while (const auto message = step_message()) {
      std::vector<RecordedNews> all;
      for (PartitionNews& news : state_->news_of(*message)) {
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
    cursor_.rewind();
    if (only) cursor_.only(*only);
    while (auto message = cursor_.next()) {
      if (message->log >= from && !visit(*message)) break;
    }
    cursor_.all_topics();
    load(now_, span_);
  }

  void read_all() {
    cursor_.rewind();
    while (cursor_.next()) {
    }
    counts_ = cursor_.counts();
    load(now_, span_);
  }

  [[nodiscard]] const std::optional<TransformCounts>& counts() const { return counts_; }
  [[nodiscard]] const State& state() const { return *state_; }
  [[nodiscard]] const Cursor& cursor() const { return cursor_; }
  [[nodiscard]] Time instant() const { return now_; }
  [[nodiscard]] std::optional<Time> start() const { return start_; }
  [[nodiscard]] std::optional<Time> end() const { return end_; }

 private:
  void load(Time at, std::chrono::nanoseconds span) {
    span_ = std::min(span, kAll);
    state_ = std::make_unique<State>();
    cursor_.start(span_ < kAll ? before(at, span_) : Time{});
    now_ = at;
    advance(at);
  }

  void advance(Time at) {
    now_ = at;
    for (auto next = cursor_.peek(); next && *next <= at; next = cursor_.peek()) {
      state_->apply(*cursor_.next());
    }
  }

  std::optional<RecordedMessage> step_message() {
    auto message = cursor_.next();
    if (!message) return std::nullopt;
    now_ = std::max(now_, message->log);
    state_->apply(*message);
    return message;
  }

  Cursor cursor_;
  std::unique_ptr<State> state_;
  Time now_{};
  std::chrono::nanoseconds span_ = kHistory;
  std::optional<Time> start_;
  std::optional<Time> end_;
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

void Recording::seek(Time at) { impl_->seek(at); }
Time Recording::instant() const { return impl_->instant(); }
bool Recording::step() { return impl_->step(); }

Result<StampedTransform> Recording::lookup(std::string_view a, std::string_view b,
                                           const Query& query) {
  return impl_->lookup(a, b, query);
}

Result<StampedTransform> Recording::lookup_at(std::string_view a, std::string_view b, Time at,
                                              const Query& query, Milliseconds wait) {
  return impl_->lookup_at(a, b, query, at, wait);
}

Result<StampedTransform> Recording::lookup_at(std::string_view a, Time at_a, std::string_view b,
                                              Time at_b, std::string_view fixed,
                                              const Query& query) {
  const auto edges_to = [&](std::string_view frame, const StampedTransform& X) {
    Query then = query;
    then.at = X.stamp;
    return edges_from_fixed(impl_->state().forest(), fixed, frame, then);
  };
  const auto X_FA = lookup_at(fixed, a, at_a, query);
  if (!X_FA) return tl::unexpected(X_FA.error());
  auto to_a = edges_to(a, *X_FA);
  if (!to_a) return tl::unexpected(std::move(to_a.error()));
  const auto X_FB = lookup_at(fixed, b, at_b, query);
  if (!X_FB) return tl::unexpected(X_FB.error());
  auto to_b = edges_to(b, *X_FB);
  if (!to_b) return tl::unexpected(std::move(to_b.error()));
  return over_fixed(*X_FA, *X_FB, *std::move(to_a), *std::move(to_b), query.order);
}

Trajectory Recording::trajectory(std::string_view a, std::string_view b,
                                 const std::vector<Time>& instants, const Query& query,
                                 Milliseconds wait) {
  return impl_->trajectory(a, b, instants, query, wait);
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
  if (joints == nullptr) return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
  return *joints;
}

Result<std::vector<HistoryInfo>> Recording::histories(const std::string& partition) const {
  if (impl_->state().joints(partition) == nullptr) {
    return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
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
      if (value.value.stamp) gaps.add(*value.value.stamp);
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
