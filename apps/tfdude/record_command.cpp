#include <csignal>
#include <cstdio>
#include <map>
#include <mutex>

#include "tfdude/recording/recording_writer.hpp"

#include "commands.hpp"
#include "render.hpp"

// Records all partitions of a domain.
namespace tfdude::cli {
namespace {

constexpr double kTick = 0.1;           // [s]
constexpr int kTicksBetweenJoints = 10;

// Passes what a client hears to a file. All functions are thread-safe.
class Recording {
 public:
  Recording(Client& client, RecordingWriter writer) : client_(client), writer_(std::move(writer)) {}

  // The news of partitions and the changes come on different threads.
  template <class... What>
  void add(const What&... what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (state_) state_ = writer_.add(what..., wall_clock());
  }

  void watch(const std::string& partition) {
    {
      const std::lock_guard<std::mutex> lock(watches_mutex_);
      if (!watches_.emplace(partition, std::nullopt).second) return;
    }
    auto watch = client_.watch_partition(
        partition, {0, [this](const PartitionNews& news) { add(news); }});
    const std::lock_guard<std::mutex> lock(watches_mutex_);
    if (watch) {
      watches_[partition] = *std::move(watch);
    } else {
      watches_.erase(partition);
    }
  }

  void on(const Change& change) {
    add(change);
    if (change.kind == ChangeKind::kPartitionUp) watch(change.partition);
  }

  [[nodiscard]] Result<void> tick() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (state_) state_ = writer_.tick(wall_clock());
    return state_;
  }

  void add_joints() {
    const auto partitions = client_.partitions();
    if (!partitions) return;
    for (const PartitionInfo& partition : *partitions) {
      if (!partition.reachable) continue;
      if (const auto joints = client_.joints(partition.name)) add(partition.name, *joints);
    }
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
    if (state_) state_ = writer_.finish(wall_clock());
    return state_;
  }

  [[nodiscard]] const RecordingWriter& writer() const { return writer_; }

 private:
  Client& client_;
  std::mutex mutex_;
  RecordingWriter writer_;
  Result<void> state_;
  std::mutex watches_mutex_;
  std::map<std::string, std::optional<PartitionWatch>> watches_;
};

}  // namespace

int run_record(Client& client, const Arguments& arguments) {
  // A limit of the file's size is reported as an error of writing.
  (void)std::signal(SIGXFSZ, SIG_IGN);
  const RecordingArguments& given = arguments.recording;
  RecordingOptions options;
  if (given.split_mb > 0) options.split_bytes = static_cast<std::uint64_t>(given.split_mb * 1e6);
  if (given.split_seconds > 0) {
    options.split_after = Milliseconds(static_cast<long>(given.split_seconds * 1e3));
  }
  auto writer = RecordingWriter::create(given.file, wall_clock(), options);
  if (!writer) return report(writer.error(), arguments);
  Recording recording(client, *std::move(writer));
  const auto partitions = client.partitions();
  if (!partitions || partitions->empty()) {
    const std::string why = partitions ? nobody_answers(arguments) : partitions.error().message;
    std::fprintf(stderr, "tfdude: %s; recording those that come\n", why.c_str());
  }
  auto changes = client.on_change([&](const Change& change) { recording.on(change); });
  if (partitions) {
    for (const PartitionInfo& partition : *partitions) recording.watch(partition.name);
  }
  recording.add_joints();
  Result<void> written;
  for (int ticks = 1; written && !interrupted_within(kTick); ++ticks) {
    if (ticks % kTicksBetweenJoints == 0) recording.add_joints();
    written = recording.tick();
  }
  changes = Subscription();
  const auto finished = recording.finish();
  if (!finished) return report(finished.error(), arguments);
  const RecordingWriter& done = recording.writer();
  return answer(arguments,
                {{"files", done.files()},
                 {"bytes", done.bytes()},
                 {"raw_bytes", done.raw_bytes()},
                 {"messages", done.messages()}},
                "recorded " + std::to_string(done.messages()) + " messages in " +
                    std::to_string(done.bytes()) + " bytes\n");
}

}  // namespace tfdude::cli
