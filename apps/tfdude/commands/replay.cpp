#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include "tfdude/base/id.hpp"
#include "tfdude/recording/recording.hpp"

#include "../../rendering/format.hpp"
#include "../commands.hpp"
#include "../replayed_partition.hpp"

namespace tfdude::cli {
namespace {

using Steady = std::chrono::steady_clock;

// In its own domain unless another one is given, so that a replay is not taken for the robot.
constexpr std::uint32_t kReplayDomain = 77;
constexpr double kStep = 0.005;                       // [s]
constexpr std::chrono::milliseconds kClockEvery{10};  // while time passes
constexpr std::chrono::milliseconds kRepeatEvery{100};
// Frames wait so long for their values, of the recording's time.
constexpr std::chrono::milliseconds kSettle{100};
// How long a time that was published may take to reach all partitions.
constexpr double kClockDelay = 0.1;  // [s]

// Keys of the terminal, or characters of another standard input, without waiting.
class Keys {
 public:
  Keys() : terminal_(isatty(STDIN_FILENO) != 0 && tcgetpgrp(STDIN_FILENO) == getpgrp()) {
    open_ = terminal_ || isatty(STDIN_FILENO) == 0;
    if (!terminal_ || tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    (void)tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;
  ~Keys() {
    if (terminal_) (void)tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }

  [[nodiscard]] std::optional<char> next() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (!open_ || poll(&input, 1, 0) <= 0) return std::nullopt;
    char key = 0;
    open_ = read(STDIN_FILENO, &key, 1) == 1;
    return open_ ? std::optional<char>(key) : std::nullopt;
  }

 private:
  bool terminal_;
  bool open_ = false;
  termios before_{};
};

// The time of the recording that is due now.
class Pace {
 public:
  Pace(Time at, double rate) : at_(at), rate_(rate) {}

  [[nodiscard]] Time now() const {
    if (paused_) return at_;
    const std::chrono::duration<double, std::nano> passed = Steady::now() - since_;
    return at_ + std::chrono::nanoseconds(static_cast<std::int64_t>(passed.count() * rate_));
  }
  void set(Time at) {
    at_ = at;
    since_ = Steady::now();
  }
  void pause(bool paused) {
    set(now());
    paused_ = paused;
  }
  [[nodiscard]] bool paused() const { return paused_; }

 private:
  Time at_;
  double rate_;
  bool paused_ = false;
  Steady::time_point since_ = Steady::now();
};

class Replay {
 public:
  Replay(Recording& recording, Client& clock, const Options& options, Time start, double rate,
         bool loop)
      : recording_(recording),
        clock_(clock),
        options_(options),
        loop_(loop),
        start_(start),
        end_(recording.summary().end.value_or(start)),
        pace_(start, rate) {
    options_.history.max_ahead = std::chrono::nanoseconds::max();
  }

  void pause(bool paused) { pace_.pause(paused); }

  // Serves what was there at the start.
  [[nodiscard]] Result<void> begin() {
    if (auto ok = publish_clock(start_); !ok) return ok;
    if (auto ok = show_state(); !ok) return ok;
    pace_.set(start_);
    return {};
  }

  // Until the end, or until interrupted.
  [[nodiscard]] Result<void> run() {
    Keys keys;
    while (!interrupted_within(kStep)) {
      while (const auto key = keys.next()) on_key(*key);
      const Time due = std::min(pace_.now(), end_);
      if (auto ok = apply_due(due); !ok) return ok;
      if (auto ok = settle(); !ok) return ok;
      if (Steady::now() - shown_ >= kRepeatEvery) show_joints();
      if (Steady::now() - published_ >= (pace_.paused() ? kRepeatEvery : kClockEvery)) {
        if (auto ok = publish_clock(due); !ok) return ok;
      }
      if (pace_.paused() || !upcoming_.empty() || due < end_) continue;
      if (!loop_) return publish_clock(end_);
      if (interrupted_within(kClockDelay)) return {};
      if (auto ok = set_back(); !ok) return ok;
      if (interrupted_within(kClockDelay)) return {};
      if (auto ok = begin(); !ok) return ok;
    }
    return {};
  }

  [[nodiscard]] std::size_t rejected() const {
    std::size_t sum = rejected_;
    for (const auto& [name, one] : partitions_) sum += one.served ? one.served->rejected() : 0;
    return sum;
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& [name, one] : partitions_) names.push_back(name);
    return names;
  }

 private:
  struct One {
    bool reachable = false;
    Time since{};  // when it became reachable, or had new frames
    std::optional<ReplayedPartition> served;
  };

  void fetch() { upcoming_ = recording_.next(); }

  [[nodiscard]] Result<void> publish_clock(Time now) {
    published_ = Steady::now();
    return clock_.publish_clock(external_time(now));
  }

  void close(One& one) {
    if (one.served) rejected_ += one.served->rejected();
    one.served.reset();
  }

  // Takes half a second, in which the replay stands still.
  [[nodiscard]] Result<void> open(const std::string& name, One& one) {
    const FramesNews* frames = nullptr;
    ValuesNews values;
    const auto state = recording_.state();
    for (const PartitionNews& news : state) {
      if (news.partition != name) continue;
      if (const auto* found = std::get_if<FramesNews>(&news.what)) frames = found;
      if (const auto* found = std::get_if<ValuesNews>(&news.what)) values = *found;
    }
    if (frames == nullptr || frames->frames.empty()) return {};
    const Time at = pace_.now();
    auto served = ReplayedPartition::open(name, *frames, values, options_);
    pace_.set(at);
    if (!served) return tl::unexpected(std::move(served.error()));
    one.served.emplace(*std::move(served));
    return {};
  }

  // At the start, also when it is reached again.
  [[nodiscard]] Result<void> show_state() {
    recording_.seek(start_);
    const auto state = recording_.state();
    for (auto& [name, one] : partitions_) one.reachable = false;
    for (const PartitionNews& news : state) {
      One& one = partitions_[news.partition];
      if (const auto* reach = std::get_if<ReachNews>(&news.what)) {
        one.reachable = reach->reachable;
      } else if (!one.served || !one.reachable) {
        continue;
      } else if (const auto* frames = std::get_if<FramesNews>(&news.what)) {
        one.served->apply(*frames);
      } else if (auto ok = one.served->apply(std::get<ValuesNews>(news.what)); !ok) {
        return ok;
      }
    }
    for (auto& [name, one] : partitions_) {
      if (!one.reachable) close(one);
      if (!one.reachable || one.served) continue;
      if (auto ok = open(name, one); !ok) return ok;
    }
    fetch();
    return {};
  }

  [[nodiscard]] Result<void> apply(const RecordedNews& recorded) {
    const PartitionNews& news = recorded.news;
    One& one = partitions_[news.partition];
    if (const auto* reach = std::get_if<ReachNews>(&news.what)) {
      if (reach->reachable && !one.reachable) one.since = recorded.time;
      one.reachable = reach->reachable;
      if (!one.reachable) close(one);
      return {};
    }
    if (const auto* frames = std::get_if<FramesNews>(&news.what)) {
      one.since = recorded.time;
      if (one.served) one.served->apply(*frames);
      return {};
    }
    if (!one.reachable) return {};
    if (!one.served) return open(news.partition, one);
    return one.served->apply(std::get<ValuesNews>(news.what));
  }

  // Frames without values.
  [[nodiscard]] Result<void> settle() {
    const Time now = recording_.instant();
    for (auto& [name, one] : partitions_) {
      if (!one.reachable || now - one.since < kSettle) continue;
      if (one.served && !one.served->settled()) one.served->settle();
      if (one.served) continue;
      one.since = now;
      if (auto ok = open(name, one); !ok) return ok;
    }
    return {};
  }

  [[nodiscard]] Result<void> apply_due(Time due) {
    while (!upcoming_.empty() && upcoming_.front().time <= due) {
      for (const RecordedNews& news : upcoming_) {
        if (auto ok = apply(news); !ok) return ok;
      }
      if (Steady::now() - published_ >= kClockEvery) {
        if (auto ok = publish_clock(upcoming_.front().time); !ok) return ok;
      }
      fetch();
    }
    return {};
  }

  void on_key(char key) {
    if (key != ' ') return;
    pause(!pace_.paused());
    std::fputs(pace_.paused() ? "tfdude: paused\n" : "tfdude: going on\n", stderr);
  }

  void show_joints() {
    shown_ = Steady::now();
    for (auto& [name, one] : partitions_) {
      if (!one.served) continue;
      if (auto joints = recording_.joints(name)) one.served->show(*std::move(joints));
    }
  }

  // First in the partitions of this process, which expect the time to jump back.
  [[nodiscard]] Result<void> set_back() {
    std::fputs("tfdude: from the beginning\n", stderr);
    for (auto& [name, one] : partitions_) {
      if (!one.served) continue;
      if (auto ok = one.served->set_time(start_); !ok) return ok;
    }
    return publish_clock(start_);
  }

  Recording& recording_;
  Client& clock_;
  NodeOptions options_;
  const bool loop_;
  const Time start_;
  const Time end_;
  Pace pace_;
  std::map<std::string, One> partitions_;
  std::vector<RecordedNews> upcoming_;  // of one message, to which the recording has gone
  Steady::time_point published_{};
  Steady::time_point shown_{};  // the joints
  std::size_t rejected_ = 0;
};

// @return kPartitionTaken: a live partition has the name of a recorded one
Result<void> check_names(Client& client, const Recording& recording) {
  const auto live = client.partitions();
  if (!live) return tl::unexpected(live.error());
  for (const PartitionInfo& recorded : recording.partitions()) {
    for (const PartitionInfo& partition : *live) {
      if (!partition.reachable || partition.name != recorded.name) continue;
      return fail(Errc::kPartitionTaken, "partition " + quote(partition.name) +
                                             " is served already, on host " + partition.host +
                                             " by process " + std::to_string(partition.pid));
    }
  }
  return {};
}

// Where the first partitions are there: a recorder discovers them only after it has begun.
Time first_frames(Recording& recording) {
  const RecordingSummary summary = recording.summary();
  recording.seek(summary.start.value_or(Time{}));
  while (recording.frames().empty() && recording.step()) continue;
  return std::min(recording.instant() + kSettle, summary.end.value_or(Time{}));
}

struct ReplayCommand final : Command {
  explicit ReplayCommand(CLI::App& app) : program(*app.get_parent()) {
    until_interrupted = true;
    add_recording_file(app, file);
    app.add_option("--rate", rate, "how many times as fast")
        ->check(within(0.001, 1000, "0.001 to 1000"));
    add_stamp(app, "--at", at,
              "where to begin: seconds since the epoch or, negative, before the end");
    app.add_flag("--loop", loop, "begin again at the end");
    app.add_flag("--paused", paused, "begin paused; a space on standard input goes on");
  }

  int run(const Common& common) const override {
    auto recording = Recording::open(file);
    if (!recording) return report(recording.error(), common);
    if (recording->partitions().empty()) {
      return report({Errc::kUnknownPartition, quote(file) + " has no partition"}, common);
    }
    const auto from = optional_stamp(Source(*recording), at);
    if (!from) return report(from.error(), common);
    Options options = common.options;
    options.clock = ClockKind::kExternal;
    if (program.count("--domain") == 0) options.domain = kReplayDomain;
    auto clock = Client::open(options);
    if (!clock) return report(clock.error(), common);
    if (auto free = check_names(*clock, *recording); !free) return report(free.error(), common);
    const Time start = *from ? **from : first_frames(*recording);
    Replay replay(*recording, *clock, options, start, rate, loop);
    replay.pause(paused);
    if (auto begun = replay.begin(); !begun) return report(begun.error(), common);
    std::fprintf(stderr,
                 "tfdude: replaying in domain %u; look with: tfdude --domain %u --clock external "
                 "tree; a space pauses\n",
                 options.domain, options.domain);
    if (auto ran = replay.run(); !ran) return report(ran.error(), common);
    std::string text = "replayed " + printable(file);
    if (replay.rejected() > 0) text += format("; %zu values rejected", replay.rejected());
    return answer(common,
                  {{"file", file}, {"partitions", replay.names()}, {"rejected", replay.rejected()}},
                  text + "\n");
  }

  const CLI::App& program;
  std::string file;
  double rate = 1;
  std::string at;
  bool loop = false;
  bool paused = false;
};

}  // namespace

void add_replay(Commands& commands) {
  commands.add<ReplayCommand>("replay", "serve the partitions of a recording again, in domain 77",
                              "replay robot.mcap --rate 0.5");
}

}  // namespace tfdude::cli
