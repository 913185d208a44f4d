#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/loop.hpp"
#include "recording/foreign_transforms.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/message_queue.hpp"
#include "recording/messages.hpp"
#include "recording/schemas.hpp"

namespace tfdude::recording {

/// The partition of the transforms of a foreign recording.
inline constexpr const char* kForeignPartition = "ros";

/// Reads the messages of a recording one after the other. In files of ours these are the messages
/// of ours; in others, the transforms of ROS.
/// @par Memory  One chunk; two while it reads ahead.
class Cursor {
 public:
  /// @return as McapReader::open(); kConfig: there is nothing in it that could be read
  [[nodiscard]] static Result<Cursor> open(std::unique_ptr<ByteSource> source);

  [[nodiscard]] const McapReader& reader() const { return reader_; }
  [[nodiscard]] bool foreign() const { return foreign_; }
  /// What is wrong with the file, as far as it was read.
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }

  /// What was found in the transforms of a foreign file since the last start or rewind.
  [[nodiscard]] const TransformCounts& counts() const { return counts_; }

  /// Goes to the last place, not later than an instant, from which everything is known without
  /// what is before. In a foreign file, transforms that were sent regularly are then left out
  /// before that instant.
  void start(Time from);
  /// Whether start() would leave chunks out that come next.
  [[nodiscard]] bool skips(Time from) const;
  /// Goes to the beginning.
  void rewind();
  /// Whether it was started at the beginning.
  [[nodiscard]] bool from_beginning() const { return first_chunk_ == 0 && !statics_before_; }

  /// From now on, reads only messages of this topic.
  void only(Topic topic) { only_ = topic; }
  void all_topics() { only_.reset(); }

  /// While it exists, the cursor reads the next chunk on another thread, for those who read on;
  /// problems() and reader() must not be used meanwhile. The messages are the same. In foreign
  /// files it has no effect, as what is read and what is taken is counted together.
  class ReadsAhead {
   public:
    explicit ReadsAhead(Cursor& cursor) : cursor_(cursor) { cursor_.reads_ahead_ = this; }
    ~ReadsAhead() { cursor_.end_reading_ahead(); }
    ReadsAhead(const ReadsAhead&) = delete;
    ReadsAhead& operator=(const ReadsAhead&) = delete;

   private:
    friend class Cursor;

    /// @return kTransport: there is no thread
    [[nodiscard]] Result<std::future<void>> begin();

    Cursor& cursor_;
    std::packaged_task<void()> task_;
    Loop loop_{"tfdude-read"};
    Loop::Job job_{loop_, [this] {
                     auto task = std::move(task_);
                     task();
                     return Loop::kNever;
                   }};
  };

  /// The log time of the next message; none at the end.
  [[nodiscard]] std::optional<Time> peek();
  /// The next message, until it is gone to, or the cursor is started or rewound. Null at the end.
  [[nodiscard]] const RecordedMessage* front();
  /// Goes to the next message. @return likewise, until this or peek() is called again
  const RecordedMessage* next();

 private:
  explicit Cursor(McapReader reader) : reader_(std::move(reader)) {}

  void begin_at(std::size_t chunk);
  [[nodiscard]] std::size_t keyframe_before(Time from) const;
  void find_topics();
  [[nodiscard]] std::optional<Topic> topic_of(std::uint16_t channel) const;
  [[nodiscard]] bool has(const ChunkPlace& chunk, Topic topic) const;
  [[nodiscard]] bool is_wanted(const ChunkPlace& chunk, bool statics_only) const;
  [[nodiscard]] bool fetch();
  void begin_to_read_ahead();
  void end_reading_ahead();
  std::size_t load(std::size_t chunk);
  void load_ahead();
  void add(const Message& message, bool statics_only);
  [[nodiscard]] Result<void> decode(Topic topic, const Message& message);
  [[nodiscard]] Result<void> decode_values(const Message& message);
  void forget_covariances();
  [[nodiscard]] Result<void> decode_transforms(bool is_static, const Message& message);
  void date_transforms();
  void note(std::string problem);

  McapReader reader_;
  bool foreign_ = false;
  std::map<std::uint16_t, Topic> topics_;
  std::size_t topics_known_ = 0;  // channels that were looked at
  std::vector<std::string> problems_;
  TransformCounts counts_;
  ForeignTransforms transforms_;
  // How far the stamps of transforms are behind the times when they were logged, most recently.
  std::optional<std::chrono::nanoseconds> behind_;
  std::optional<Topic> only_;
  std::size_t first_chunk_ = 0;
  std::optional<Time> statics_before_;
  std::size_t chunk_ = 0;  // the next one
  MessageQueue loaded_;    // of the chunk that follows
  MessageQueue waiting_;
  bool front_is_taken_ = false;  // by transforms_
  std::unique_ptr<EdgeTable> edges_ = std::make_unique<EdgeTable>();
  ValuesDecoder decoder_{*edges_};
  ReadsAhead* reads_ahead_ = nullptr;
  // Ends when loaded_ is that of the next chunk. Until then it uses all of the above but waiting_.
  std::future<void> ahead_;
};

}  // namespace tfdude::recording
