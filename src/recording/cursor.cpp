#include "recording/cursor.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "types/ros_tf.hpp"

namespace tfdude::recording {
namespace {

// Of a file that is damaged throughout, not every place is told.
constexpr std::size_t kMostProblems = 20;

// Stamps that differ by more from the times when they were logged are of another clock: as much as
// live histories have.
constexpr std::chrono::seconds kOtherClock{10};

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

Time log_of(const Message& message) { return checked_time(message.log_time); }

}  // namespace

Result<Cursor> Cursor::open(std::unique_ptr<ByteSource> source) {
  auto reader = McapReader::open(std::move(source));
  if (!reader) return tl::unexpected(std::move(reader.error()));
  Cursor cursor(*std::move(reader));
  cursor.problems_ = cursor.reader_.problems();
  const auto& metadata = cursor.reader_.metadata();
  cursor.foreign_ = std::none_of(metadata.begin(), metadata.end(),
                                 [](const Metadata& one) { return one.name == "tfdude"; });
  cursor.find_topics();
  if (cursor.foreign_ && !cursor.peek()) {
    const std::size_t known = cursor.reader_.problems().size();
    if (cursor.problems_.size() > known) {
      return fail(Errc::kConfig, "nothing of it can be read: " + cursor.problems_[known]);
    }
    if (cursor.topics_.empty()) {
      return fail(Errc::kConfig,
                  "it has no transforms: neither a recording of tf-dude nor /tf of ROS");
    }
  }
  cursor.rewind();
  return cursor;
}

void Cursor::find_topics() {
  if (topics_known_ == reader_.channels().size()) return;
  topics_known_ = reader_.channels().size();
  for (const auto& [id, channel] : reader_.channels()) {
    const Schema* schema = reader_.schema(channel.schema);
    if (schema == nullptr || channel.encoding != "cdr") continue;
    if (foreign_) {
      if (schema->name != ros::kTfType) continue;
      topics_[id] = ends_with(channel.topic, "tf_static") ? Topic::kTfStatic : Topic::kTf;
      continue;
    }
    for (const TopicType& type : topic_types()) {
      if (type.name == channel.topic && type.type == schema->name) topics_[id] = type.topic;
    }
  }
}

std::optional<Topic> Cursor::topic_of(std::uint16_t channel) const {
  const auto found = topics_.find(channel);
  if (found == topics_.end()) return std::nullopt;
  return found->second;
}

bool Cursor::has(const ChunkPlace& chunk, Topic topic) const {
  return std::any_of(chunk.channels.begin(), chunk.channels.end(),
                     [&](std::uint16_t channel) { return topic_of(channel) == topic; });
}

void Cursor::begin_at(std::size_t chunk) {
  if (ahead_.valid()) ahead_.get();
  first_chunk_ = chunk_ = chunk;
  loaded_ = {};
  waiting_ = {};
  front_is_taken_ = false;
  decoder_ = ValuesDecoder(*edges_);
  counts_ = {};
  transforms_ = {};
  behind_.reset();
}

void Cursor::rewind() {
  statics_before_.reset();
  begin_at(0);
}

void Cursor::start(Time from) {
  rewind();
  if (foreign_) {
    const auto& chunks = reader_.chunks();
    if (!chunks.empty() && checked_time(chunks.front().start) < from) statics_before_ = from;
    return;
  }
  begin_at(keyframe_before(from));
}

bool Cursor::skips(Time from) const {
  if (ahead_.valid()) ahead_.wait();
  return !foreign_ && keyframe_before(from) > chunk_;
}

std::size_t Cursor::keyframe_before(Time from) const {
  const auto& chunks = reader_.chunks();
  std::size_t place = 0;
  for (std::size_t i = 0; i < chunks.size() && checked_time(chunks[i].start) <= from; ++i) {
    if (has(chunks[i], Topic::kKeyframe)) place = i;
  }
  return place;
}

bool Cursor::is_wanted(const ChunkPlace& chunk, bool statics_only) const {
  if (chunk.channels.empty()) return true;
  if (statics_only) return has(chunk, Topic::kTfStatic);
  if (only_) return has(chunk, *only_);
  return std::any_of(chunk.channels.begin(), chunk.channels.end(), [&](std::uint16_t channel) {
    const auto topic = topic_of(channel);
    return topic && (foreign_ || *topic >= Topic::kFrames);
  });
}

void Cursor::note(std::string problem) {
  if (problems_.size() < kMostProblems &&
      std::find(problems_.begin(), problems_.end(), problem) == problems_.end()) {
    problems_.push_back(std::move(problem));
  }
}

// @return the bytes of its messages
std::size_t Cursor::load(std::size_t number) {
  std::size_t bytes = 0;
  // The channels of a file without a summary may be in its chunks.
  if (auto ok = reader_.learn_channels(number); !ok) note(ok.error().message);
  find_topics();
  const ChunkPlace& chunk = reader_.chunks()[number];
  const bool statics_only = statics_before_ && checked_time(chunk.end) < *statics_before_;
  if (!is_wanted(chunk, statics_only)) return bytes;
  auto read = reader_.read(chunk, [&](const Message& message) {
    find_topics();
    add(message, statics_only);
    bytes += message.data.size();
    return true;
  });
  if (!read) {
    note(read.error().message);
    forget_covariances();
  }
  if (!foreign_) return bytes;
  std::stable_sort(
      loaded_.begin(), loaded_.end(),
      [](const RecordedMessage& a, const RecordedMessage& b) { return a.log < b.log; });
  date_transforms();
  return bytes;
}

// The last chunk before a keyframe may be small. While it is taken, there would be too little time
// for the next one.
void Cursor::load_ahead() {
  constexpr std::size_t kLeast = std::size_t{1} << 20U;
  for (std::size_t bytes = 0; bytes < kLeast && chunk_ < reader_.chunks().size();) {
    bytes += load(chunk_++);
  }
}

// A stamp of 0 was not set: as in the bridge, the value is one of the time of its arrival. If the
// other stamps are of another clock, a simulation's for example, that is the time which this clock
// then had: the stamp of the next sample that has one, less what passed in between. After the last
// such sample it goes on from there.
void Cursor::date_transforms() {
  const auto each_sample = [&](auto visit) {
    for (auto message = loaded_.end(); message != loaded_.begin();) {
      --message;
      auto& values = std::get<RecordedValues>(message->what).values;
      for (auto value = values.rbegin(); value != values.rend(); ++value) {
        if (value->stamp && !visit(message->log, *value)) return;
      }
    }
  };
  each_sample([&](Time log, const RecordedValue& value) {
    if (!value.dated) behind_ = log - *value.stamp;
    return value.dated;
  });
  auto behind = behind_.value_or(std::chrono::nanoseconds());
  each_sample([&](Time log, RecordedValue& value) {
    if (!value.dated) {
      behind = log - *value.stamp;
      return true;
    }
    const bool other_clock = std::chrono::abs(behind) > kOtherClock;
    value.stamp = other_clock ? checked_time(nanoseconds(log) - behind.count()) : log;
    ++counts_.unstamped;
    note("frame " + quote(value.edge->id) +
         ": its messages have no stamp (0): taken as of the time when they were logged");
    return true;
  });
}

void Cursor::add(const Message& message, bool statics_only) {
  const auto topic = topic_of(message.channel);
  if (!topic || (only_ && *topic != *only_) || (statics_only && *topic != Topic::kTfStatic)) return;
  if (auto ok = decode(*topic, message); !ok) note(ok.error().message);
}

Result<void> Cursor::decode(Topic topic, const Message& message) {
  const auto take = [&](auto decoded) -> Result<void> {
    if (!decoded) return tl::unexpected(std::move(decoded.error()));
    loaded_.add() = {log_of(message), *std::move(decoded), false};
    return {};
  };
  switch (topic) {
    case Topic::kFrames:
      return take(decode_frames(message.data));
    case Topic::kValues:
      return decode_values(message);
    case Topic::kJoints:
      return take(decode_joints(message.data));
    case Topic::kEvents:
      return take(decode_event(message.data));
    case Topic::kTf:
    case Topic::kTfStatic:
      if (foreign_) return decode_transforms(topic == Topic::kTfStatic, message);
      return {};
    case Topic::kKeyframe:
      return {};
  }
  return {};
}

// Most messages are these, so they reuse the memory of earlier ones.
Result<void> Cursor::decode_values(const Message& message) {
  RecordedMessage& recorded = loaded_.add();
  auto* values = std::get_if<RecordedValues>(&recorded.what);
  if (values == nullptr) values = &recorded.what.emplace<RecordedValues>();
  recorded.log = log_of(message);
  recorded.foreign = false;
  auto ok = decoder_.decode(message.data, *values);
  if (!ok) {
    loaded_.drop_last();
    forget_covariances();
  }
  return ok;
}

// The next value "with the covariance as before" may mean one that could not be read. It is left
// out then, until all is told again.
void Cursor::forget_covariances() { decoder_ = ValuesDecoder(*edges_); }

Result<void> Cursor::decode_transforms(bool is_static, const Message& message) {
  auto transforms = decode_tf(message.data, *edges_);
  if (!transforms) {
    ++counts_.messages;
    return tl::unexpected(std::move(transforms.error()));
  }
  for (RecordedValue& value : transforms->values) {
    if (!is_static) continue;
    value.stamp.reset();
    value.dated = false;
  }
  counts_ += transforms->counts;
  for (std::string& why : transforms->left_out) note(std::move(why));
  loaded_.add() = {log_of(message),
                   RecordedValues{kForeignPartition, 0, false, std::move(transforms->values)},
                   true};
  return {};
}

Result<std::future<void>> Cursor::ReadsAhead::begin() {
  if (auto begun = loop_.begin(); !begun) return tl::unexpected(std::move(begun.error()));
  task_ = std::packaged_task<void()>([this] { cursor_.load_ahead(); });
  auto ended = task_.get_future();
  job_.ask();
  return ended;
}

void Cursor::begin_to_read_ahead() {
  if (reads_ahead_ == nullptr || foreign_ || chunk_ == reader_.chunks().size()) return;
  if (auto begun = reads_ahead_->begin()) {
    ahead_ = *std::move(begun);
  } else {
    reads_ahead_ = nullptr;
  }
}

void Cursor::end_reading_ahead() {
  reads_ahead_ = nullptr;
  if (ahead_.valid()) ahead_.get();
}

// Puts the messages of the next chunk where they wait. @return whether there is one
bool Cursor::fetch() {
  if (ahead_.valid()) {
    ahead_.get();
  } else if (loaded_.empty()) {
    if (chunk_ == reader_.chunks().size()) return false;
    (void)load(chunk_++);
  }
  waiting_.clear();
  std::swap(waiting_, loaded_);
  begin_to_read_ahead();
  return true;
}

std::optional<Time> Cursor::peek() {
  while (waiting_.empty() && fetch()) {
  }
  if (waiting_.empty()) return std::nullopt;
  return waiting_.front().log;
}

const RecordedMessage* Cursor::front() {
  if (!peek()) return nullptr;
  RecordedMessage& message = waiting_.front();
  if (message.foreign && !std::exchange(front_is_taken_, true)) {
    transforms_.take(std::get<RecordedValues>(message.what).values, counts_,
                     [this](std::string problem) { note(std::move(problem)); });
  }
  return &message;
}

const RecordedMessage* Cursor::next() {
  const RecordedMessage* message = front();
  if (message == nullptr) return nullptr;
  waiting_.pop();
  front_is_taken_ = false;
  return message;
}

}  // namespace tfdude::recording
