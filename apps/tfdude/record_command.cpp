#include <atomic>
#include <csignal>
#include <cstdio>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "tfdude/base/id.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "commands.hpp"
#include "recording_options.hpp"

// Records all partitions of a domain.
namespace tfdude::cli {
namespace {

constexpr double kFlushEvery = 0.8;  // [s]: with what that takes, at most a second is lost
constexpr double kTick = 0.1;        // [s]
constexpr int kTicksBetweenLooks = 2;

// Passes what a client hears to a file. All functions are thread-safe.
class Recorder {
 public:
  Recorder(Client& client, ClockKind clock, RecordingWriter writer)
      : client_(client), clock_(clock), writer_(std::move(writer)) {}

  void watch(const std::string& partition) {
    {
      const std::lock_guard<std::mutex> lock(watches_mutex_);
      if (!watches_.emplace(partition, std::nullopt).second) return;
    }
    auto watch =
        client_.watch_partition(partition, {0, [this](const PartitionNews& news) { add(news); }});
    const std::lock_guard<std::mutex> lock(watches_mutex_);
    if (watch) {
      watches_[partition] = *std::move(watch);
      return;
    }
    watches_.erase(partition);
    if (!failed_.insert(partition).second) return;
    std::fprintf(stderr, "tfdude: partition %s is not recorded yet: %s\n", partition.c_str(),
                 watch.error().message.c_str());
  }

  void on(const Change& change) {
    add(change);
    if (change.kind == ChangeKind::kPartitionUp) watch(change.partition);
  }

  // The joints of all partitions; and those that could not be watched are tried again.
  void look_again() {
    const auto partitions = client_.partitions();
    if (!partitions) return;
    for (const PartitionInfo& partition : *partitions) {
      if (!partition.reachable) continue;
      watch(partition.name);
      if (const auto joints = client_.joints(partition.name)) add(partition.name, *joints);
    }
  }

  [[nodiscard]] Result<void> flush() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (state_) state_ = writer_.flush(now());
    return state_;
  }

  // Ends all watches, then the file.
  [[nodiscard]] Result<void> finish() {
    std::map<std::string, std::optional<PartitionWatch>> watches;
    {
      const std::lock_guard<std::mutex> lock(watches_mutex_);
      watches.swap(watches_);
    }
    watches.clear();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (state_) state_ = writer_.finish(now());
    return state_;
  }

  [[nodiscard]] bool has_partition() {
    const std::lock_guard<std::mutex> lock(watches_mutex_);
    return !watches_.empty();
  }

  // After finish().
  [[nodiscard]] const RecordingWriter& writer() const { return writer_; }

 private:
  // The news of partitions, the changes and the joints come on different threads.
  template <class... What>
  void add(const What&... what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (state_) state_ = writer_.add(what..., now());
  }

  Time now() {
    if (clock_ == ClockKind::kSystem) return wall_clock();
    if (const auto external = client_.now()) last_ = *external;
    return last_;
  }

  Client& client_;
  const ClockKind clock_;
  std::mutex mutex_;
  RecordingWriter writer_;
  Result<void> state_;
  Time last_{};
  std::mutex watches_mutex_;
  std::map<std::string, std::optional<PartitionWatch>> watches_;
  std::set<std::string> failed_;  // to watch, and it was said
};

RecordingOptions options_of(const RecordingArguments& given) {
  RecordingOptions options;
  if (given.split_mb > 0) options.split_bytes = static_cast<std::uint64_t>(given.split_mb * 1e6);
  if (given.split_s > 0) {
    options.split_after = Milliseconds(static_cast<std::int64_t>(given.split_s * 1e3));
  }
  options.compress = !given.raw;
  return options;
}

// Records until interrupted, or until the file cannot be written.
Result<void> record(Client& client, Recorder& recorder, const Arguments& arguments) {
  // Completes discovery first, so that partitions that exist already are no events.
  const auto partitions = client.partitions();
  if (!partitions || partitions->empty()) {
    const std::string why = partitions ? nobody_answers(arguments) : partitions.error().message;
    std::fprintf(stderr, "tfdude: %s; recording those that come\n", why.c_str());
  }
  auto changes = client.on_change([&](const Change& change) { recorder.on(change); });
  if (partitions) {
    for (const PartitionInfo& partition : *partitions) recorder.watch(partition.name);
  }
  // On its own thread, because an owner that does not answer is waited for.
  std::atomic<bool> stopping{false};
  std::thread looking([&] {
    for (int ticks = 0; !stopping; ++ticks) {
      if (ticks % kTicksBetweenLooks == 0) recorder.look_again();
      std::this_thread::sleep_for(std::chrono::duration<double>(kTick));
    }
  });
  Result<void> written;
  while (written && !interrupted_within(kFlushEvery)) written = recorder.flush();
  stopping = true;
  looking.join();
  changes = Subscription();
  if (!recorder.has_partition()) std::fputs("tfdude: no partition was recorded\n", stderr);
  return recorder.finish();
}

}  // namespace

int run_record(Client& client, const Arguments& arguments) {
  // A limit of the file's size is reported as an error of writing.
  (void)std::signal(SIGXFSZ, SIG_IGN);
  const ClockKind clock = arguments.options.clock;
  const auto begin = clock == ClockKind::kSystem ? Result<Time>(wall_clock()) : client.now();
  if (!begin) return report(begin.error(), arguments);
  auto writer =
      RecordingWriter::create(arguments.recording.file, *begin, options_of(arguments.recording));
  if (!writer) return report(writer.error(), arguments);
  std::fprintf(stderr, "tfdude: recording to %s\n", printable(arguments.recording.file).c_str());
  Recorder recorder(client, clock, *std::move(writer));
  const auto recorded = record(client, recorder, arguments);
  if (!recorded) return report(recorded.error(), arguments);
  const RecordingWriter& done = recorder.writer();
  std::string text;
  for (const std::string& file : done.files()) text += printable(file) + "\n";
  text += std::to_string(done.messages()) + " messages of " + std::to_string(done.raw_bytes()) +
          " bytes in " + std::to_string(done.bytes()) + " bytes\n";
  return answer(arguments,
                {{"files", done.files()},
                 {"bytes", done.bytes()},
                 {"raw_bytes", done.raw_bytes()},
                 {"messages", done.messages()}},
                text);
}

}  // namespace tfdude::cli
