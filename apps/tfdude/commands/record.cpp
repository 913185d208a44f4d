#include <csignal>
#include <cstdio>
#include <map>
#include <mutex>
#include <set>

#include "tfdude/base/id.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "../../worker.hpp"
#include "../commands.hpp"

namespace tfdude::cli {
namespace {

constexpr double kFlushEvery = 0.8;  // [s]: with what that takes, at most a second is lost
constexpr std::chrono::milliseconds kRefreshEvery{200};

// Writes the news of all partitions to a file. All functions are thread-safe.
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
  void refresh() {
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

// Records until interrupted, or until the file cannot be written.
Result<void> record(Client& client, Recorder& recorder, const Common& common) {
  // Completes discovery first, so that partitions that exist already are no events.
  const auto partitions = client.partitions();
  warn_without(partitions, common, "; recording those that come");
  auto changes = client.on_change([&](const Change& change) { recorder.on(change); });
  if (partitions) {
    for (const PartitionInfo& partition : *partitions) recorder.watch(partition.name);
  }
  // On its own thread, because an owner that does not answer is waited for.
  Worker worker;
  worker.post([&] { recorder.refresh(); });
  worker.repeat(kRefreshEvery, [&] { recorder.refresh(); });
  Result<void> written;
  while (written && !interrupted_within(kFlushEvery)) written = recorder.flush();
  worker.stop();
  changes = Subscription();
  if (!recorder.has_partition()) std::fputs("tfdude: no partition was recorded\n", stderr);
  return recorder.finish();
}

struct Record final : LiveCommand {
  explicit Record(CLI::App& app) {
    until_interrupted = true;
    add_recording_file(app, file);
    app.add_option("--split-size", split_mb, "begin another file after so many megabytes")
        ->type_name("MB")
        ->check(within(1, 1e9, "1 to 1e9"));
    app.add_option("--split-time", split_s, "begin another file after so many seconds")
        ->type_name("SECONDS")
        ->check(within(1, 1e9, "1 to 1e9"));
    app.add_flag("--raw", raw, "do not compress");
  }

  int ask(Client& client, const Common& common) const override {
    // A limit of the file's size is reported as an error of writing.
    (void)std::signal(SIGXFSZ, SIG_IGN);
    const ClockKind clock = common.options.clock;
    const auto begin = clock == ClockKind::kSystem ? Result<Time>(wall_clock()) : client.now();
    if (!begin) return report(begin.error(), common);
    auto writer = RecordingWriter::create(file, *begin, options());
    if (!writer) return report(writer.error(), common);
    std::fprintf(stderr, "tfdude: recording to %s\n", printable(file).c_str());
    Recorder recorder(client, clock, *std::move(writer));
    const auto recorded = record(client, recorder, common);
    if (!recorded) return report(recorded.error(), common);
    const RecordingWriter& done = recorder.writer();
    std::string text;
    for (const std::string& written : done.files()) text += printable(written) + "\n";
    text += std::to_string(done.messages()) + " messages of " + std::to_string(done.raw_bytes()) +
            " bytes in " + std::to_string(done.bytes()) + " bytes\n";
    return answer(common,
                  {{"files", done.files()},
                   {"bytes", done.bytes()},
                   {"raw_bytes", done.raw_bytes()},
                   {"messages", done.messages()}},
                  text);
  }

  [[nodiscard]] RecordingOptions options() const {
    RecordingOptions options;
    if (split_mb > 0) options.split_bytes = static_cast<std::uint64_t>(split_mb * 1e6);
    if (split_s > 0) options.split_after = Milliseconds(static_cast<std::int64_t>(split_s * 1e3));
    options.compress = !raw;
    return options;
  }

  std::string file;
  double split_mb = 0;  // 0: as RecordingOptions
  double split_s = 0;   // 0: never
  bool raw = false;
};

}  // namespace

void add_record(Commands& commands) {
  commands.add<Record>("record", "record all partitions, until interrupted", "record robot.mcap");
}

}  // namespace tfdude::cli
