#include "simulation/samples.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/base/time.hpp"
#include "tfdude/types/edge.hpp"

namespace tfdude::simulation {
namespace {

using std::chrono::seconds;

// Longer than the span of a history and the longest run together, so that no sample of one era is
// late in another.
constexpr seconds kJump{1000};
constexpr double kTolerance = 1e-6;

const EdgeTiming& timing() {
  static const EdgeTiming usual;
  return usual;
}

// The number of the sample whose value this is, or a number between those of two.
double shown_number(const Transform& X) { return X.pose.translation().y(); }

bool same(double a, double b) { return std::abs(a - b) < kTolerance; }

std::string text(double number) { return "value " + std::to_string(number); }

}  // namespace

Time Samples::clock(std::chrono::nanoseconds now) const {
  constexpr seconds kBeginning{1'000'000};
  return Time(kBeginning - era_ * kJump + now);
}

std::size_t Samples::send(Time stamp) {
  samples_.push_back({stamp, era_});
  return samples_.size() - 1;
}

bool Samples::era_is_taken() const {
  return std::any_of(samples_.begin(), samples_.end(),
                     [this](const Sample& one) { return one.era == era_ && one.taken_by != 0; });
}

bool Samples::came_late(std::size_t number) const {
  const auto sent = samples_.begin() + static_cast<std::ptrdiff_t>(number);
  return std::any_of(samples_.begin(), sent, [&](const Sample& one) {
    return one.era == sent->era && one.stamp > sent->stamp;
  });
}

// ---- what a process has

// The latest one of which it certainly had a sample.
std::optional<int> Samples::era_of(std::uint64_t process) const {
  std::optional<int> latest;
  for (const Sample& one : samples_) {
    if (one.taken_by == process) latest = one.era;
  }
  return latest;
}

std::size_t Samples::sent_in(int era) const {
  const auto sent = std::count_if(samples_.begin(), samples_.end(),
                                  [era](const Sample& one) { return one.era == era; });
  return static_cast<std::size_t>(sent);
}

// Whether a history with samples of an earlier era may have restarted in this one.
bool Samples::may_be_in(int era) const {
  const bool any = std::any_of(samples_.begin(), samples_.end(), [era](const Sample& one) {
    return one.era == era && !one.rejected;
  });
  return any && sent_in(era) >= timing().restart_after;
}

Samples::History Samples::history_of(std::uint64_t process) const {
  const auto era = era_of(process);
  bool restarted = false;
  for (int later = era.value_or(era_) + 1; later <= era_; ++later) {
    restarted = restarted || may_be_in(later);
  }
  History history;
  for (std::size_t number = 0; number < samples_.size(); ++number) {
    const Sample& one = samples_[number];
    // What was sent in an earlier era arrived before the restart.
    const bool possible = !era || one.era == *era || (one.era > *era && may_be_in(one.era));
    if (one.rejected || !possible) continue;
    history.push_back({number, one.stamp, !restarted && one.taken_by == process && one.era == era});
  }
  std::sort(history.begin(), history.end(),
            [](const Kept& a, const Kept& b) { return a.stamp < b.stamp; });
  for (Kept& one : history) {
    if (one.stamp < history.back().stamp - timing().span) one.certain = false;
  }
  return history;
}

// ---- writing

Samples::Broken Samples::taken(std::size_t number, std::uint64_t by) {
  Sample& sample = samples_[number];
  const auto era = era_of(by);
  sample.taken_by = by;
  if (!era || *era >= sample.era) return {};
  ++restarts_;
  if (sent_in(sample.era) >= timing().restart_after) return {};
  return {"a history restarts too early", "after " + std::to_string(sent_in(sample.era)) +
                                              " samples that are older than those kept"};
}

Samples::Broken Samples::rejected(std::size_t number, std::uint64_t by, const Error& why) {
  Sample& sample = samples_[number];
  // The owner keeps its answer to a request that is repeated.
  if (why.code == Errc::kStampTaken) return {"a request is applied twice", why.message};
  if (why.code == Errc::kInvalidInput) return {"a valid sample is rejected", why.message};
  if (why.code != Errc::kTooOld) return {};
  sample.rejected = true;
  if (era_of(by) == sample.era) return {"a sample is rejected that the history spans", why.message};
  if (++rejected_[{sample.era, by}] < timing().restart_after) return {};
  return {"a history does not restart", why.message};
}

// ---- reading

Samples::Broken Samples::answered(std::optional<Time> at, std::uint64_t by,
                                  const Result<StampedTransform>& X) {
  if (!X) return judge_error(at, by, X.error());
  if (!X->stamp) return judge_static(*X, by);
  return at ? judge_at(*at, *X, by) : judge_newest(*X, by);
}

// Only the configured value holds for all times: a process that was started again has the last
// sample with its stamp.
Samples::Broken Samples::judge_static(const StampedTransform& X, std::uint64_t by) const {
  if (era_of(by)) return {"a history is lost", text(shown_number(X)) + " holds for all times"};
  if (same(shown_number(X), 0)) return {};
  return {"a value that nobody wrote", text(shown_number(X)) + " holds for all times"};
}

Samples::Broken Samples::judge_newest(const StampedTransform& X, std::uint64_t by) {
  const History history = history_of(by);
  const auto newest =
      std::find_if(history.rbegin(), history.rend(), [](const Kept& one) { return one.certain; });
  if (newest != history.rend() && *X.stamp < newest->stamp) {
    return {"a newer sample is known",
            text(shown_number(X)) + " after sample " + std::to_string(newest->number)};
  }
  const auto shown = std::find_if(history.begin(), history.end(),
                                  [&](const Kept& one) { return one.stamp == *X.stamp; });
  if (shown == history.end() || !same(shown_number(X), static_cast<double>(shown->number))) {
    return {"a value that nobody wrote", text(shown_number(X)) + " at " + to_string(*X.stamp)};
  }
  // The last one of an earlier process may have been restored: the next one begins a history.
  if (!era_of(by)) return {};
  return taken(shown->number, by);
}

// Between two samples that may be next to each other.
Samples::Broken Samples::judge_at(Time at, const StampedTransform& X, std::uint64_t by) const {
  if (*X.stamp != at) return {"an answer for another instant", to_string(*X.stamp)};
  const History history = history_of(by);
  std::string expected;
  const auto first_after = std::lower_bound(history.begin(), history.end(), at,
                                            [](const Kept& one, Time t) { return one.stamp < t; });
  for (auto after = first_after; after != history.end(); ++after) {
    if (after->stamp == at) {
      if (same(shown_number(X), static_cast<double>(after->number))) return {};
      if (after->certain) break;
      continue;
    }
    for (auto before = first_after; before != history.begin();) {
      --before;
      const double share = std::chrono::duration<double>(at - before->stamp) /
                           std::chrono::duration<double>(after->stamp - before->stamp);
      const double a = static_cast<double>(before->number);
      const double value = a + share * (static_cast<double>(after->number) - a);
      if (same(shown_number(X), value)) return {};
      expected += " " + std::to_string(value);
      if (before->certain) break;
    }
    if (after->certain) break;
  }
  return {"a value between others",
          text(shown_number(X)) + " at " + to_string(at) + ", not one of" + expected};
}

Samples::Broken Samples::judge_error(std::optional<Time> at, std::uint64_t by,
                                     const Error& error) const {
  if (!at || (error.code != Errc::kTooOld && error.code != Errc::kNotYet)) return {};
  const History history = history_of(by);
  const bool has = std::any_of(history.begin(), history.end(), [&](const Kept& one) {
    if (!one.certain) return false;
    return error.code == Errc::kTooOld ? one.stamp <= *at : one.stamp >= *at;
  });
  if (!has) return {};
  return {"a sample is lost", error.message};
}

}  // namespace tfdude::simulation
