#include <algorithm>
#include <cmath>
#include <thread>

#include "tfdude/base/id.hpp"

#include "client/participant.hpp"

// Lookups at an instant over several partitions, those that wait, and paths that are pushed.
namespace tfdude {
namespace {

// How often is looked for data that have not come yet: soon after they should be there, else at this rate.
constexpr Milliseconds kLookAgain{1};
constexpr Milliseconds kLongestSleep{50};

// What may come yet.
bool is_worth_waiting(const Error& error, const Query& query) {
  switch (error.code) {
    case Errc::kNotYet:
    case Errc::kUnknownStart:
    case Errc::kUnknownEnd:
    case Errc::kNotConnected:
    case Errc::kUnreachable:
    case Errc::kTimeout:
    case Errc::kNotOwner:
      return true;
    case Errc::kTooOld:
      // Of the newest common instant: where one edge is ahead of what another has.
      return !query.at;
    default:
      return false;
  }
}

/// A lookup on a thread of its own.
class AsyncLookup final : public Cancellations::Task {
 public:
  using Job = std::function<void(Cancellation&)>;

  explicit AsyncLookup(Job job)
      : thread_([shared = shared_, job = std::move(job)] {
          job(shared->cancellation);
          shared->done = true;
        }) {}
  ~AsyncLookup() override { stop(); }
  AsyncLookup(const AsyncLookup&) = delete;
  AsyncLookup& operator=(const AsyncLookup&) = delete;

  [[nodiscard]] bool done() const override { return shared_->done; }

  void stop() override {
    shared_->cancellation.cancel();
    const std::lock_guard lock(join_mutex_);
    if (!thread_.joinable()) return;
    if (thread_.get_id() == std::this_thread::get_id()) {
      thread_.detach();  // its callback ends it
    } else {
      thread_.join();
    }
  }

 private:
  // What the thread has still where its callback has ended it.
  struct Shared {
    Cancellation cancellation;
    std::atomic<bool> done{false};
  };

  const std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  std::mutex join_mutex_;
  std::thread thread_;  // last: it uses the rest
};

}  // namespace

Result<std::vector<SegmentValues>> Participant::ask_values(std::vector<Part>& parts) {
  std::vector<SegmentValues> answers;
  for (Reply& reply : ask(parts, Clock::now() + options_.timeout)) {
    if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
    auto* values = std::get_if<SegmentValues>(&reply.body);
    answers.push_back(values != nullptr ? std::move(*values) : SegmentValues());
  }
  return answers;
}

Result<StampedTransform> Participant::gather(LookupPlan& plan, const std::string& a,
                                             const std::string& b, std::optional<Time> hint) {
  auto answers = ask_values(plan.parts);
  if (!answers) return tl::unexpected(std::move(answers.error()));
  const bool newest =
      !plan.parts.empty() && !std::get<LookupRequest>(plan.parts.front().request.body).query.at;
  if (!newest || plan.parts.size() == 1) return assemble(plan, *answers);
  {
    const std::lock_guard lock(hints_mutex_);
    hints_.note(a, b, Clock::now(), *answers);
  }
  OneInstant found = one_instant(*std::move(answers), hint);
  if (!found.ask_again) return assemble(plan, found.answers);
  for (Part& part : plan.parts) {
    auto& lookup = std::get<LookupRequest>(part.request.body);
    lookup.query.at = found.ask_again;
    lookup.hint.reset();
  }
  answers = ask_values(plan.parts);
  if (!answers) return tl::unexpected(std::move(answers.error()));
  return assemble(plan, *answers);
}

Result<StampedTransform> Participant::lookup_elsewhere(std::string_view a, std::string_view b,
                                                       const Query& query) {
  const std::string start(a);
  const std::string end(b);
  std::optional<Time> hint;
  if (!query.at) {
    const std::lock_guard lock(hints_mutex_);
    hint = hints_.guess(a, b, Clock::now());
  }
  return healed([&] { return route_lookup(forest_, directory_, start, end, query, hint); },
                [&](LookupPlan& plan) { return gather(plan, start, end, hint); });
}

Result<StampedTransform> Participant::lookup_elsewhere(Handle a, Handle b, const Query& query) {
  const auto start = forest_.info(a);
  if (!start) return fail(Errc::kUnknownStart, "the first frame was removed");
  const auto end = forest_.info(b);
  if (!end) return fail(Errc::kUnknownEnd, "the second frame was removed");
  return lookup_elsewhere(start->id, end->id, query);
}

Result<StampedTransform> Participant::lookup_waiting(std::string_view a, std::string_view b,
                                                     const Query& query, Milliseconds wait,
                                                     Cancellation* cancelled) {
  const auto deadline = Clock::now() + wait;
  Cancellation nobody;
  Cancellation& cancellation = cancelled != nullptr ? *cancelled : nobody;
  while (true) {
    auto found = lookup(a, b, query);
    const auto now = Clock::now();
    if (found || now >= deadline || !is_worth_waiting(found.error(), query)) return found;
    // Most sources stamp by a clock that runs as the wall clock does.
    std::chrono::nanoseconds pause = kLookAgain;
    if (query.at) {
      pause =
          std::clamp<std::chrono::nanoseconds>(*query.at - wall_clock(), kLookAgain, kLongestSleep);
    }
    if (cancellation.wait_until(std::min(deadline, now + pause))) {
      return fail(Errc::kTimeout, "the lookup was cancelled: " + found.error().message);
    }
  }
}

std::shared_ptr<void> Participant::lookup_async(const std::string& a, const std::string& b,
                                                const Query& query, Milliseconds wait,
                                                PendingLookup::Callback callback) {
  auto task = std::make_shared<AsyncLookup>(
      [this, a, b, query, wait, callback = std::move(callback)](Cancellation& cancellation) {
        auto found = lookup_waiting(a, b, query, wait, &cancellation);
        if (!cancellation.wait_until(Clock::time_point::min())) callback(std::move(found));
      });
  pending_.add(task);
  return task;
}

std::future<Result<StampedTransform>> Participant::lookup_async(const std::string& a,
                                                                const std::string& b,
                                                                const Query& query,
                                                                Milliseconds wait) {
  auto promise = std::make_shared<std::promise<Result<StampedTransform>>>();
  auto future = promise->get_future();
  pending_.keep(
      std::make_shared<AsyncLookup>([this, a, b, query, wait, promise](auto& cancellation) {
        promise->set_value(lookup_waiting(a, b, query, wait, &cancellation));
      }));
  return future;
}

Result<std::vector<PastInfo>> Participant::past(const std::string& id) {
  return healed(
      [&]() -> Result<Part> {
        const auto info = forest_.info(id);
        if (!info) return fail(Errc::kUnknownFrame, "no frame " + quote(id));
        return route_to(directory_, info->owner, Request{0, id, PastRequest{}});
      },
      [&](Part& part) { return ask_list<PastInfo>(std::move(part)); });
}

Result<std::vector<PastInfo>> Participant::pasts(const std::string& partition) {
  return ask_all<PastInfo>(partition, PastRequest{true});
}

// --- pushed paths ---

Result<WatchedPath::Route> Participant::plan_watch(const WatchedPath& path) {
  const WatchOptions& options = path.options();
  std::chrono::nanoseconds period{0};
  if (options.rate > 0) period = std::chrono::nanoseconds(std::llround(1e9 / options.rate));
  const std::lock_guard lock(structure_mutex_);
  auto plan = route_watch(forest_, directory_, path.a(), path.b(), options.composed, period);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  WatchedPath::Route route{std::move(plan->edges), {}, std::move(plan->parts)};
  for (const Part& part : route.parts) {
    const auto& request = std::get<WatchRequest>(part.request.body);
    const auto serving = directory_.serving(part.partition);
    WatchedPath::Source source{part.partition, serving ? serving->incarnation : 0,
                               watch_group(part.partition, request), request.edges};
    for (const PathEnds& segment : request.segments) source.frames.push_back(segment.to);
    route.sources.push_back(std::move(source));
  }
  return route;
}

Result<std::shared_ptr<WatchedPath>> Participant::watch(const std::string& a, const std::string& b,
                                                        const WatchOptions& options) {
  if (!(options.rate >= 0) || options.rate > 1e6) {
    return fail(Errc::kInvalidInput, "the rate of a watch must be within 0 and 1e6 Hz, not " +
                                         std::to_string(options.rate));
  }
  auto known = routed([&] { return forest_.segments(a, b); });
  if (!known) return tl::unexpected(std::move(known.error()));
  Watches* watches = nullptr;
  {
    const std::lock_guard lock(pushing_mutex_);
    if (watches_ == nullptr) {
      watches_ = std::make_unique<Watches>(Watches::Links{
          [this](const WatchedPath& path) { return plan_watch(path); },
          [this](std::vector<Part>& parts) { return ask(parts, Clock::now() + options_.timeout); },
          [this](std::uint64_t group) { return transport_->watch(group); },
          [this](std::uint64_t group) { transport_->unwatch(group); }});
      watching_.store(watches_.get());
    }
    watches = watches_.get();
  }
  auto path = watches->watch(a, b, options);
  if (auto live = path->wait_until_live(Clock::now() + options_.timeout); !live) {
    return tl::unexpected(std::move(live.error()));
  }
  return path;
}

Reply Participant::answer_watch(const Request& request) {
  const auto& watch = std::get<WatchRequest>(request.body);
  Pusher* pusher = nullptr;
  {
    const std::lock_guard lock(pushing_mutex_);
    if (leaving_) {
      const std::string who = "partition " + quote(partition_name_);
      return {request.sequence, 0, Error{Errc::kNotOwner, who + " is leaving"}};
    }
    if (pusher_ == nullptr) {
      pusher_ = std::make_unique<Pusher>(
          forest_,
          [this](const State& state) {
            transport_->push(state);
            if (Watches* watches = watching_.load()) watches->on_state(state);
          },
          [this](std::uint64_t group) { transport_->end_pushing(group); });
    }
    pusher = pusher_.get();
  }
  auto state = pusher->watch(watch_group(partition_name_, watch), watch);
  if (!state) return {request.sequence, 0, std::move(state.error())};
  if (tied_entries(*state) > kMaxTies) {
    return {request.sequence, 0,
            Error{Errc::kInvalidInput, "partition " + quote(partition_name_) + " has more than " +
                                           std::to_string(kMaxTies) +
                                           " edges of the path that are tied to others"}};
  }
  return {request.sequence, 0, *std::move(state)};
}

void Participant::on_state(const State& state) {
  if (Watches* watches = watching_.load()) watches->on_state(state);
}

void Participant::look_at_watches() {
  if (Watches* watches = watching_.load()) watches->look_again();
}

}  // namespace tfdude
