#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/recording/transform_counts.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/partition_news.hpp"

#include "base/cdr.hpp"
#include "recording/edge_table.hpp"

// The messages of a recording: to bytes, and from bytes of unknown origin.
namespace tfdude::recording {

/// Times of a file that are within this range can be subtracted from each other.
inline constexpr std::int64_t kMaxTime = 4'000'000'000'000'000'000;

/// The time nearest to this one that can be used.
[[nodiscard]] inline Time checked_time(std::int64_t ns) {
  return time_of(std::clamp<std::int64_t>(ns, 0, kMaxTime));
}

/// A value of an edge.
struct RecordedValue {
  /// What few values have; as of WatchedValue.
  struct Rest {
    Correlation correlation;
    std::optional<Covariance> begins;
    std::optional<Time> kept_before;
    bool drifts = false;
  };

  /// Whether it is a sample, and tells nothing else.
  [[nodiscard]] bool is_sample() const { return stamp && !cleared && !unsampled && !rest; }
  [[nodiscard]] Rest& more() {
    if (rest == nullptr) rest = std::make_unique<Rest>();
    return *rest;
  }
  [[nodiscard]] WatchedValue watched(std::uint32_t frame) const;

  const RecordedEdge* edge = nullptr;  ///< of the table of who has read the message
  std::optional<Time> stamp;
  Transform X_PC;
  bool cleared = false;
  bool unsampled = false;
  bool dated = false;          ///< of ROS: its stamp was 0, which nobody has set
  std::unique_ptr<Rest> rest;  ///< null: nothing of that
};

struct RecordedValues {
  std::string partition;
  std::uint64_t commit = 0;
  bool repeats = false;
  std::vector<RecordedValue> values;
};

struct RecordedFrames {
  std::string partition;
  std::uint64_t incarnation = 0;
  bool reachable = true;
  std::string why;
  bool complete = false;
  bool repeats = false;
  std::vector<WatchedFrame> frames;
  std::vector<std::string> removed;
};

struct RecordedJoints {
  std::string partition;
  bool repeats = false;
  std::vector<JointInfo> joints;
};

/// Writes the values of one message one after the other.
class ValuesEncoder {
 public:
  /// @param out  replaced by the message
  ValuesEncoder(std::string& out, std::string_view partition, std::uint64_t commit, bool repeats);
  /// @param as_before  the covariance is that of the edge's last value in the file
  void add(const WatchedFrame& edge, const WatchedValue& value, bool as_before);
  void finish() {
    writer_.set(count_place_, count_);
    put_kept();
    writer_.finish();
  }

 private:
  void put_kept();

  CdrWriter writer_;
  std::size_t count_place_;
  std::uint32_t count_ = 0;
  std::vector<std::pair<std::uint32_t, Time>> kept_;  // WatchedValue::kept_before, by value
};

/// Reads values, in the order of the file from a keyframe or the beginning on.
class ValuesDecoder {
 public:
  /// @param edges  gets those of the values, and must outlive them
  explicit ValuesDecoder(EdgeTable& edges) : edges_(&edges) {}

  /// @param out  replaced, so that its memory can be used again; of no use after an error
  /// @return kConfig: not a valid message; values that are not valid are left out, as are those of
  ///   their edges that follow with the covariance as before
  [[nodiscard]] Result<void> decode(std::string_view message, RecordedValues& out);

 private:
  // @return whether it is valid
  [[nodiscard]] bool decode_value(CdrReader& reader, RecordedValue& value);
  [[nodiscard]] bool read_value(CdrReader& reader, RecordedValue& value);
  // Null: it is not valid.
  [[nodiscard]] const RecordedEdge* decode_edge(CdrReader& reader);
  [[nodiscard]] std::optional<Covariance::Upper>& last_of(const RecordedEdge& edge);
  void decode_kept(CdrReader& reader, std::vector<RecordedValue>& values) const;

  EdgeTable* edges_;
  std::vector<std::optional<Covariance::Upper>> last_;  // by RecordedEdge::frame
  std::vector<std::uint32_t> numbers_;  // of the values that are valid, in their message
};

void encode(const RecordedFrames& frames, std::string& out);
void encode(const RecordedJoints& joints, std::string& out);
void encode(const Change& change, std::string& out);
void encode_keyframe(bool ends, std::string& out);

/// @return kConfig: not a valid message
[[nodiscard]] Result<RecordedFrames> decode_frames(std::string_view message);
[[nodiscard]] Result<RecordedJoints> decode_joints(std::string_view message);
[[nodiscard]] Result<Change> decode_event(std::string_view message);
[[nodiscard]] Result<bool> decode_keyframe(std::string_view message);

/// The transforms of a TFMessage.
struct RecordedTransforms {
  std::vector<RecordedValue> values;  ///< their covariance is unspecified
  std::vector<std::string> left_out;  ///< of each invalid transform, what is wrong with it
  TransformCounts counts;             ///< of these
};

/// By the rules of the bridge to ROS. @return kConfig: not a valid message
/// @param edges  as of ValuesDecoder
[[nodiscard]] Result<RecordedTransforms> decode_tf(std::string_view message, EdgeTable& edges);

}  // namespace tfdude::recording
