#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/partition_news.hpp"

#include "recording/schemas.hpp"

namespace tfdude::recording {

/// Turns what happens into the messages of a recording. Knows no file and no clock.
/// @par Memory  The frames, their newest values, and the joints.
/// @par Thread safety  One thread at a time.
class Recorder {
 public:
  struct Record {
    Topic topic;
    Time log;      ///< when it was recorded
    Time publish;  ///< when it was measured or written, as far as known
    std::string_view data;
  };
  using Out = std::function<Result<void>(const Record&)>;

  explicit Recorder(Out out) : out_(std::move(out)) {}

  // Each of these fails as `out` does.
  [[nodiscard]] Result<void> add(const PartitionNews& news, Time now);
  [[nodiscard]] Result<void> add(const std::string& partition, const std::vector<JointInfo>& joints,
                                 Time now);
  [[nodiscard]] Result<void> add(const Change& change, Time now);

  /// All that is known, for those who start to read here.
  [[nodiscard]] Result<void> keyframe(Time now);
  /// The values that hold for all times, in one message as ROS has them, if they have changed.
  [[nodiscard]] Result<void> write_statics(Time now);

  [[nodiscard]] std::size_t partitions() const { return partitions_.size(); }
  [[nodiscard]] std::size_t edges() const;

 private:
  struct Edge {
    std::optional<WatchedValue> newest;  // with its process noise as the beginning of a history
    // The last covariance in the file, since the keyframe if there is one.
    std::optional<Covariance> written;
  };
  struct Known {
    bool reachable = false;
    std::string why;
    std::uint64_t incarnation = 0;
    std::vector<WatchedFrame> frames;
    std::vector<Edge> edges;  // by frame
    std::string joints;       // the last message
  };

  [[nodiscard]] Result<void> put(Topic topic, Time now, std::optional<Time> publish = {});
  [[nodiscard]] Result<void> reach(const std::string& name, Known& known, const ReachNews& news,
                                   Time now);
  [[nodiscard]] Result<void> change(const std::string& name, Known& known, const FramesNews& news,
                                    Time now);
  [[nodiscard]] Result<void> write(const std::string& name, Known& known, const ValuesNews& news,
                                   Time now);
  [[nodiscard]] Result<void> write_tf(const Known& known, const ValuesNews& news, Time now);
  [[nodiscard]] Result<void> repeat(const std::string& name, Known& known, Time now);

  const Out out_;
  std::map<std::string, Known> partitions_;
  bool statics_changed_ = false;
  std::string message_;
};

}  // namespace tfdude::recording
