#include "simulation/sampler.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "faults/frames.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_of;
using faults::denies;
using faults::partition_name;
using std::chrono::nanoseconds;

// How late a sample may be; far less than the span of a history.
constexpr milliseconds kLatest{2000};

// How many samples are looked up in the end.
constexpr std::size_t kLookedBack = 60;

Transform value_of(std::size_t number) {
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {0, static_cast<double>(number), 0}), {}};
}

}  // namespace

Sampler::Sampler(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
                 std::size_t owners)
    : Actor(std::move(process), "sampler", actor, owners, milliseconds(40)), number_(number) {}

std::string Sampler::frame() const {
  return "s" + std::to_string(number_) + "_" + std::to_string(generation_);
}

void Sampler::step() {
  if (!added_) return add();
  if (random_.index(30) == 0) {
    samples_.jump_back();
    process_->world().count("the clock of a source jumped back");
  }
  if (random_.index(3) != 0) return write();
  if (samples_.size() == 1 || random_.index(4) == 0) return look_up(std::nullopt, false);
  look_up(any_instant(), false);
}

void Sampler::begin(const std::string& what, const std::shared_ptr<Task>& task, Then then) {
  Actor::begin(what, task, [this, then = std::move(then)](const Result<void>& outcome) {
    // What was sent without an answer arrives before what is sent next, or is lost.
    if (!outcome) rest_ = process_->world().network.longest_delay();
    then(outcome);
    if (!outcome && denies(outcome.error().code)) added_ = false;
  });
}

void Sampler::check(const Samples::Broken& broken) {
  if (!broken.empty()) process_->world().violation(broken.kind, frame() + ": " + broken.what);
}

// Uses a new name, because the state of the former frame is not known.
void Sampler::add() {
  ++generation_;
  samples_ = {};
  streamed_.clear();
  base_ = base_of(random_.index(owners_));
  partition_ = partition_name(random_.index(owners_));
  begin("add", RunningCall::change([this, id = frame()] {
          return route_add(process_->forest(), process_->directory(), id,
                           AddRequest{base_, value_of(0)}, partition_)
              .map([](Part part) { return std::vector<Part>{std::move(part)}; });
        }),
        [this](const Result<void>& added) {
          added_ = added.has_value();
          if (added_) watch();
          next();
        });
}

std::vector<EdgeUpdate> Sampler::edge(std::size_t number) const {
  return {{frame(), value_of(number)}};
}

void Sampler::write() {
  // Of samples that are older than the history, only those in order make it restart.
  const bool late = samples_.era_is_taken() && random_.index(4) == 0;
  Time stamp = samples_.clock(process_->world().timeline.now());
  if (late)
    stamp -= nanoseconds(static_cast<nanoseconds::rep>(
        random_.uniform(0, static_cast<double>(nanoseconds(kLatest).count()))));
  const std::size_t number = samples_.send(stamp);
  late_ = late;
  if (random_.index(3) == 0) return stream(number);
  request(number);
}

void Sampler::stream(std::size_t number) {
  auto parts = route_publish(process_->forest(), process_->directory(), edge(number),
                             samples_.stamp(number));
  streamed_.insert(number);
  process_->world().trace(frame() + ": streams sample " + std::to_string(number));
  if (parts) {
    for (const Part& part : *parts) {
      process_->stream(part.partition, Update{edge(number), samples_.stamp(number)});
    }
  }
  rest_ = process_->world().network.longest_delay();
  next();
}

void Sampler::request(std::size_t number) {
  const auto task = RunningCall::change([this, number] {
    return route_update(process_->forest(), process_->directory(), edge(number),
                        samples_.stamp(number));
  });
  begin("sample " + std::to_string(number), task,
        [this, number, task](const Result<void>& updated) {
          if (!task->parts().empty()) {
            const std::uint64_t by = process_->replied_by(task->parts().front());
            const std::size_t before = samples_.restarts();
            check(updated ? samples_.taken(number, by)
                          : samples_.rejected(number, by, updated.error()));
            if (samples_.restarts() > before) process_->world().count("a history was restarted");
            if (updated && late_) process_->world().count("a late sample was taken");
          }
          next();
        });
}

Time Sampler::any_instant() {
  const std::size_t number = 1 + random_.index(samples_.size() - 1);
  const Time stamp = samples_.stamp(number);
  if (random_.index(4) == 0) return stamp;
  return stamp + nanoseconds(static_cast<nanoseconds::rep>(random_.uniform(-1e8, 1e8)));
}

void Sampler::look_up(std::optional<Time> at, bool last) {
  Query query;
  query.at = at;
  const auto task = process_->lookup(base_, frame(), query);
  begin(at ? "lookup-at " + to_string(*at) : std::string("lookup"), task,
        [this, at, task, last](const Result<void>& outcome) {
          const Result<StampedTransform> X = outcome.map([&] { return task->X_AB(); });
          const std::uint64_t by =
              task->parts().empty() ? 0 : process_->replied_by(task->parts().front());
          if (by != 0) check(samples_.answered(at, by, X));
          if (X && X->stamp && !at) see(X->pose.translation().y());
          if (X && X->stamp && at) process_->world().count("a sample was looked up at an instant");
          const bool answered =
              X || X.error().code == Errc::kTooOld || X.error().code == Errc::kNotYet;
          if (last && !answered) {
            process_->world().violation("a sampled edge is not found",
                                        frame() + ": " + X.error().message);
          }
          if (!last) next();
        });
}

void Sampler::watch() {
  watch_ = std::make_shared<WatchedPath>(base_, frame(), WatchOptions());
  shown_groups_.clear();
  process_->watch(watch_, [this, id = frame()] {
    if (id == frame()) look_at_watch();
  });
}

// Each process of the owner has a group of its own, which begins with its answer.
void Sampler::look_at_watch() {
  auto groups = watch_->lookup({}) ? watch_->groups({}) : std::set<std::uint64_t>();
  if (groups == shown_groups_) return;
  shown_groups_ = std::move(groups);
  watched_from_ = samples_.size();
}

void Sampler::check_watch(const Forest& owner) {
  Surroundings& world = process_->world();
  std::vector<EdgeCursor> all{{frame(), base_}};
  for (const PushedValue& kept : owner.values_since(all, {false, Time()}).values) {
    const auto number = static_cast<std::size_t>(std::lround(kept.X.pose.translation().y()));
    if (!kept.stamp || number < watched_from_ || samples_.came_late(number)) continue;
    world.count("watched samples checked");
    Query query;
    query.at = kept.stamp;
    const auto X = watch_->lookup(query);
    const std::string what = frame() + ": sample " + std::to_string(number) + ": ";
    if (!X) {
      world.violation("a watch misses a sample", what + X.error().message);
    } else if (std::abs(X->pose.translation().y() - static_cast<double>(number)) > 1e-6) {
      world.violation("a watch misses a sample",
                      what + "value " + std::to_string(X->pose.translation().y()));
    }
  }
}

void Sampler::see(double value) {
  const auto number = static_cast<std::size_t>(std::lround(value));
  if (streamed_.count(number) > 0) process_->world().count("a streamed sample was seen");
}

void Sampler::look_back() {
  look_up(std::nullopt, true);
  const std::size_t first = std::max<std::size_t>(samples_.size(), kLookedBack) - kLookedBack;
  for (std::size_t number = std::max<std::size_t>(first, 1); number < samples_.size(); ++number) {
    look_up(samples_.stamp(number), true);
  }
}

}  // namespace tfdude::simulation
