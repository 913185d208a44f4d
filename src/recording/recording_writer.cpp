#include "tfdude/recording/recording_writer.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/types/version.hpp"

#include "recording/mcap_writer.hpp"
#include "recording/output_file.hpp"
#include "recording/recorder.hpp"

namespace tfdude {
namespace {

using namespace recording;

// A clock that goes back by more has jumped: times within one file never go back.
constexpr std::chrono::seconds kJump{1};
// A message of all static values is written at most so often.
constexpr Milliseconds kStaticsEvery{1000};
constexpr std::size_t kChunkBytes = std::size_t{4} << 20U;
// A reader that starts in the middle reads at most so much before it has all values, or so many
// times what they need.
constexpr std::uint64_t kKeyframeEvery = std::uint64_t{8} << 20U;
constexpr std::uint64_t kKeyframeShare = 8;

constexpr std::string_view kExtension = ".mcap";

// robot.mcap, robot_1.mcap ...
std::string name_of(const std::string& file, std::size_t number) {
  if (number == 0) return file;
  const bool extended =
      file.size() > kExtension.size() &&
      file.compare(file.size() - kExtension.size(), kExtension.size(), kExtension) == 0;
  const std::string stem = extended ? file.substr(0, file.size() - kExtension.size()) : file;
  return stem + "_" + std::to_string(number) + (extended ? std::string(kExtension) : "");
}

std::uint16_t id_of(Topic topic) { return static_cast<std::uint16_t>(static_cast<int>(topic) + 1); }

}  // namespace

class RecordingWriter::Impl {
 public:
  Impl(std::string file, const RecordingOptions& options)
      : file_(std::move(file)),
        options_(options),
        recorder_([this](const Recorder::Record& record) {
          return writer_->write({id_of(record.topic), nanoseconds(record.log),
                                 nanoseconds(record.publish), record.data});
        }) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() = default;

  // Begins the next file.
  [[nodiscard]] Result<void> begin(Time now) {
    auto output = OutputFile::create(name_of(file_, files_.size()));
    if (!output) return tl::unexpected(std::move(output.error()));
    output_ = *std::move(output);
    files_.push_back(name_of(file_, files_.size()));
    McapWriter::Settings settings;
    settings.profile = "ros2";
    settings.library = version_line();
    settings.compress = options_.compress;
    settings.chunk_bytes = kChunkBytes;
    writer_.emplace([this](std::string_view bytes) { return output_->write(bytes); }, settings);
    if (auto ok = begin_types(); !ok) return ok;
    begun_ = now;
    return keyframe(now);
  }

  // Runs one function of the recorder.
  template <class Record>
  [[nodiscard]] Result<void> record(Time now, Record record) {
    if (!state_) return state_;
    if (now_ - now > kJump) {
      now_ = now;
      state_ = split(now_);
    }
    now_ = std::max(now_, now);
    if (state_) state_ = record(recorder_, now_);
    if (state_) state_ = after(now_);
    return state_;
  }

  [[nodiscard]] Result<void> flush(Time now) {
    auto ok = record(now, [](Recorder&, Time) { return Result<void>(); });
    if (ok && writer_->pending()) ok = state_ = writer_->flush();
    return ok;
  }

  [[nodiscard]] Result<void> finish(Time now) {
    if (!state_) return state_;
    now_ = std::max(now_, now);
    state_ = recorder_.write_statics(now_);
    if (state_) state_ = writer_->finish();
    if (!state_) return state_;
    state_ = fail(Errc::kInvalidInput, "the recording is finished");
    return {};
  }

  [[nodiscard]] const std::vector<std::string>& files() const { return files_; }
  [[nodiscard]] std::uint64_t bytes() const { return earlier_bytes_ + writer_->size(); }
  [[nodiscard]] std::uint64_t raw_bytes() const { return earlier_raw_ + writer_->raw_size(); }
  [[nodiscard]] std::uint64_t messages() const { return earlier_messages_ + writer_->messages(); }
  [[nodiscard]] Time now() const { return now_; }

 private:
  [[nodiscard]] Result<void> begin_types() {
    if (auto ok = writer_->start(); !ok) return ok;
    std::map<std::string_view, std::uint16_t> schemas;
    for (const TopicType& type : topic_types()) {
      const std::uint16_t id = id_of(type.topic);
      if (schemas.emplace(type.type, id).second) {
        auto ok = writer_->add_schema(
            {id, std::string(type.type), "ros2msg", std::string(type.definition)});
        if (!ok) return ok;
      }
      Channel channel{id, schemas.at(type.type), std::string(type.name), "cdr", {}};
      if (!type.qos.empty()) channel.metadata["offered_qos_profiles"] = type.qos;
      if (auto ok = writer_->add_channel(channel); !ok) return ok;
    }
    return writer_->add_metadata(
        {"tfdude", {{"format", "1"}, {"file", std::to_string(files_.size() - 1)}}});
  }

  [[nodiscard]] Result<void> keyframe(Time now) {
    if (auto ok = writer_->flush(); !ok) return ok;
    const std::uint64_t before = writer_->raw_size();
    if (auto ok = recorder_.keyframe(now); !ok) return ok;
    keyframe_end_ = writer_->raw_size();
    keyframe_size_ = keyframe_end_ - before;
    statics_at_ = now;
    return {};
  }

  // What is due after a record.
  [[nodiscard]] Result<void> after(Time now) {
    if (now - statics_at_ >= kStaticsEvery) {
      statics_at_ = now;
      if (auto ok = recorder_.write_statics(now); !ok) return ok;
    }
    const bool full = writer_->size() >= options_.split_bytes;
    const auto age = std::chrono::duration_cast<Milliseconds>(now - begun_);
    if (full || age >= options_.split_after) return split(now);
    if (writer_->raw_size() - keyframe_end_ >=
        std::max(kKeyframeEvery, kKeyframeShare * keyframe_size_)) {
      return keyframe(now);
    }
    return {};
  }

  [[nodiscard]] Result<void> split(Time now) {
    if (auto ok = writer_->finish(); !ok) return ok;
    earlier_bytes_ += writer_->size();
    earlier_raw_ += writer_->raw_size();
    earlier_messages_ += writer_->messages();
    return begin(now);
  }

  const std::string file_;
  const RecordingOptions options_;
  std::unique_ptr<OutputFile> output_;
  std::optional<McapWriter> writer_;
  Recorder recorder_;
  Result<void> state_;
  std::vector<std::string> files_;
  Time now_{};
  Time begun_{};
  Time statics_at_{};
  std::uint64_t keyframe_end_ = 0;
  std::uint64_t keyframe_size_ = 0;
  std::uint64_t earlier_bytes_ = 0;
  std::uint64_t earlier_raw_ = 0;
  std::uint64_t earlier_messages_ = 0;
};

RecordingWriter::RecordingWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() {
  if (impl_ != nullptr) (void)impl_->finish(impl_->now());
}

Result<RecordingWriter> RecordingWriter::create(const std::string& file, Time now,
                                                const RecordingOptions& options) {
  auto impl = std::make_unique<Impl>(file, options);
  if (auto ok = impl->begin(now); !ok) return tl::unexpected(std::move(ok.error()));
  return RecordingWriter(std::move(impl));
}

Result<void> RecordingWriter::add(const PartitionNews& news, Time now) {
  return impl_->record(now, [&](Recorder& recorder, Time at) { return recorder.add(news, at); });
}

Result<void> RecordingWriter::add(const std::string& partition,
                                  const std::vector<JointInfo>& joints, Time now) {
  return impl_->record(
      now, [&](Recorder& recorder, Time at) { return recorder.add(partition, joints, at); });
}

Result<void> RecordingWriter::add(const Change& change, Time now) {
  return impl_->record(now, [&](Recorder& recorder, Time at) { return recorder.add(change, at); });
}

Result<void> RecordingWriter::flush(Time now) { return impl_->flush(now); }

Result<void> RecordingWriter::finish(Time now) { return impl_->finish(now); }
std::vector<std::string> RecordingWriter::files() const { return impl_->files(); }
std::uint64_t RecordingWriter::bytes() const { return impl_->bytes(); }
std::uint64_t RecordingWriter::raw_bytes() const { return impl_->raw_bytes(); }
std::uint64_t RecordingWriter::messages() const { return impl_->messages(); }

}  // namespace tfdude
