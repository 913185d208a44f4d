#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/recording/transform_counts.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/many.hpp"
#include "tfdude/types/partition_info.hpp"
#include "tfdude/types/partition_news.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// What a recording contains.
struct RecordingSummary {
  std::string library;        ///< that wrote the file
  bool foreign = false;       ///< transforms of ROS, without covariances and owners
  bool finished = false;      ///< false: its writer was interrupted
  std::optional<Time> start;  ///< of the recording; absent: it is empty
  std::optional<Time> end;
  std::uint64_t bytes = 0;
  std::size_t chunks = 0;
  std::optional<std::uint64_t> messages;  ///< absent: not known without reading the file
  /// What is wrong with the file, as far as it was read; sentences for people.
  std::vector<std::string> problems;
  /// Transforms of ROS that were left out; absent: the whole file was not read for it.
  std::optional<std::size_t> left_out{};
  /// The same by kind, and what else was found in them.
  std::optional<TransformCounts> transforms{};
};

/// A recorded change of frames or values, and when it was recorded.
struct RecordedNews {
  Time time;
  PartitionNews news;
};

/// A recording, which is asked the same questions as a Client, without a network.
///
/// A recording shows one instant: what the recorder knew then, in the structure that it knew then.
/// seek() goes to another one. Answers are those that the live system gave at that instant, with
/// covariance, sources and unspecified edges, up to rounding; but here the history is not limited
/// to some seconds.
///
/// Recordings of ROS (MCAP files with tf2_msgs/msg/TFMessage) can be asked as well. Their frames
/// belong to one partition, "ros", and covariances are unspecified.
/// @par Memory  At most about 1 GB of samples, mostly much less, and one chunk of the file; two in
///   trajectory().
/// @par Thread safety  One thread at a time.
class TFDUDE_EXPORT Recording {
 public:
  /// Opens an MCAP file, also one that was not finished or is damaged in places: what can be read
  /// is read. Shows the end of the recording.
  /// @return kConfig: it cannot be read, or has no transforms; kTooMuch: it exceeds a limit
  [[nodiscard]] static Result<Recording> open(const std::string& file);
  /// The same of bytes in memory.
  [[nodiscard]] static Result<Recording> read(std::string_view bytes);
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  Recording(Recording&&) noexcept;
  Recording& operator=(Recording&&) noexcept;
  ~Recording();

  [[nodiscard]] RecordingSummary summary() const;
  /// Reads the whole file, so that summary() knows all that is wrong with it, and left out.
  void read_all();

  /// Goes to an instant. From the next earlier place where all values are written once more, or
  /// from where it is, the file is read up to there: mostly 8 to 16 MB.
  void seek(Time at);
  /// Where a stamp is looked up: at that instant, or at the end if it is more than 10 s before the
  /// beginning, as stamps of another clock are.
  [[nodiscard]] Time instant_for(Time stamp) const;
  /// The instant that is shown.
  [[nodiscard]] Time instant() const;
  /// Goes to the next message. @return whether there is one
  bool step();

  /// X_AB as Client::lookup() with this query answered at the instant that is shown. With
  /// Query::believed_at, here and below: goes to that instant first, and does not read on. Nothing
  /// of the recording is too old for that.
  /// @return as Client::lookup()
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query = {});
  /// X_AB at a stamp, as Client::lookup() with a wait answered it when it was asked at
  /// instant_for() it: goes there, and then on until all edges have their data, but not beyond a
  /// change of the structure between the frames.
  /// @param wait  how long, of the time of the recording
  [[nodiscard]] Result<StampedTransform> lookup_at(std::string_view a, std::string_view b, Time at,
                                                   const Query& query = {},
                                                   Milliseconds wait = Milliseconds(10'000));
  /// As Client::lookup() with a fixed frame.
  [[nodiscard]] Result<StampedTransform> lookup_at(std::string_view a, Time at_a,
                                                   std::string_view b, Time at_b,
                                                   std::string_view fixed, const Query& query = {});

  /// X_AB at many instants, in any order: each as lookup_at() answers it, but the file is read
  /// once, from the first instant on. Then the recording shows where the reading has ended.
  /// @param query  Query::at is not used
  /// @param wait  for each instant, of the time of the recording
  [[nodiscard]] Trajectory trajectory(std::string_view a, std::string_view b,
                                      const std::vector<Time>& instants, const Query& query = {},
                                      Milliseconds wait = Milliseconds(10'000));

  // As the functions of Client, at the instant that is shown.
  [[nodiscard]] Result<std::vector<PathSegment>> path(std::string_view a, std::string_view b) const;
  [[nodiscard]] Result<std::string> parent(const std::string& id) const;
  [[nodiscard]] Result<std::vector<std::string>> children(const std::string& id) const;
  [[nodiscard]] std::vector<std::string> roots() const;
  [[nodiscard]] bool exists(const std::string& id) const;
  [[nodiscard]] std::vector<Frame> frames() const;
  [[nodiscard]] std::vector<PartitionInfo> partitions() const;
  /// Joints are recorded five times a second.
  [[nodiscard]] Result<std::vector<JointInfo>> joints(const std::string& partition) const;
  /// The samples that are loaded, up to the instant that is shown.
  [[nodiscard]] Result<std::vector<HistoryInfo>> histories(const std::string& partition) const;

  /// All samples of an edge in the whole recording; reads the whole file. Empty for a static edge.
  /// @return kUnknownFrame
  [[nodiscard]] Result<std::vector<HistoryInfo>> history(const std::string& id);
  /// Calls a function for each recorded event, from an instant on, until it returns false.
  void events(Time from, const std::function<bool(const Change&)>& visit);

  /// For players: what a watch of each partition reported if it began at the instant that is
  /// shown.
  [[nodiscard]] std::vector<PartitionNews> state() const;
  /// And what followed: of the next message that has any. Goes there. Empty at the end.
  [[nodiscard]] std::vector<RecordedNews> next();

 private:
  class Impl;
  explicit Recording(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tfdude
