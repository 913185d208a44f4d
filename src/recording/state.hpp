#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "tfdude/types/frame.hpp"
#include "tfdude/types/partition_info.hpp"

#include "recording/cursor.hpp"
#include "tree/forest.hpp"

namespace tfdude::recording {

/// A partition that was not reachable when a lookup needed it.
struct Lost {
  std::string partition;
  std::uint64_t incarnation = 0;  ///< of its process then
  Error error;
  std::vector<std::string> frames{};  ///< at whose edges it was needed
};

/// Whether the process of a partition that was lost has returned.
enum class Returned {
  kNo,
  kPerhaps,  ///< the partition has; the next message says of which process
  kYes,
  kAsOther,  ///< another process serves the partition
};

/// What was known at an instant of a recording: one forest with the frames of all partitions, as a
/// watched path has one of its edges.
/// @par Memory  As many samples as all edges together may have.
class State {
 public:
  State();

  /// Applies the next message.
  void apply(const RecordedMessage& message);
  /// What a watch would have reported of the message that was applied last; nothing for one that
  /// only repeats, or is of another kind.
  [[nodiscard]] std::vector<PartitionNews> news_of(const RecordedMessage& message);

  [[nodiscard]] const Forest& forest() const { return forest_; }
  /// As Forest::lookup(); kUnreachable if the owner of an edge was, and kNotYet also if an edge has
  /// no value yet.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query) const;
  /// The first owner on the path that is not reachable.
  [[nodiscard]] std::optional<Lost> lost(std::string_view a, std::string_view b) const;
  [[nodiscard]] Returned returned(const Lost& lost, Time now) const;
  /// Whether a message that comes next changes how two frames are connected, or are not: what is
  /// known after it says nothing of the structure before. Not so the first frames of a partition
  /// that was reachable before, nor the move for which a frame waits. O(depth), and the size of the
  /// message.
  /// @param known_by  from when on the partition must have been reachable, at most
  [[nodiscard]] bool changes_path(const RecordedMessage& message, std::string_view a,
                                  std::string_view b, Time known_by) const;
  /// The runs of edges of one owner, of a path that begins here.
  [[nodiscard]] std::vector<PathSegment> segments(const std::vector<FrameInfo>& edges,
                                                  std::string_view from) const;
  /// The owner; empty: unknown.
  [[nodiscard]] std::string owner(const std::string& frame) const;
  [[nodiscard]] std::vector<Frame> frames() const;
  [[nodiscard]] std::vector<PartitionInfo> partitions() const;
  /// Null: no such partition.
  [[nodiscard]] const std::vector<JointInfo>* joints(const std::string& partition) const;

  /// What a watch of each partition would have reported if it began now.
  [[nodiscard]] std::vector<PartitionNews> news() const;

 private:
  struct Known {
    PartitionInfo info;
    std::string why;
    std::uint64_t incarnation = 0;
    bool has_state = false;        // its frames have come
    std::optional<Time> returned;  // since when it is reachable, perhaps as another process
    std::map<std::string, std::string> frames;                   // parents
    std::unordered_map<std::string_view, std::uint32_t> places;  // of the frames; or empty
    std::vector<JointInfo> joints;
  };

  void apply(const RecordedFrames& frames, Time log);
  void apply(const RecordedValues& values, bool foreign);
  [[nodiscard]] bool take_samples(const Known& known, const RecordedValues& recorded);
  void take_values(Known& known, const RecordedValues& recorded, bool foreign);
  [[nodiscard]] std::optional<Handle> edge_of(Known& known, const RecordedEdge& edge, bool repeats,
                                              bool foreign);
  [[nodiscard]] static PartitionNews news_of(const RecordedValues& recorded, Known& known);
  void put(Known& known, const std::vector<WatchedFrame>& frames, bool begins = false);
  [[nodiscard]] bool detach(Known& known, const WatchedFrame& frame, bool begins);
  void attach(const WatchedFrame& frame);
  void mend();
  [[nodiscard]] std::optional<Lost> lost(const std::vector<FrameInfo>& edges) const;
  void drop(Known& known, const std::string& id);
  [[nodiscard]] std::unordered_set<std::string> path_frames(std::string_view a,
                                                            std::string_view b) const;
  void share_memory();
  // The frame's handle if the edge is one of the partition, and has a value.
  [[nodiscard]] std::optional<Handle> settled(const Known& known, const RecordedEdge& edge) const;
  void settle(const Known& known, const RecordedEdge& edge, Handle handle);
  [[nodiscard]] Known& partition(const std::string& name);
  [[nodiscard]] static FramesNews frames_of(const Known& known);

  Forest forest_;
  std::map<std::string, Known> partitions_;
  std::unordered_map<std::string, std::string> owners_;  // by frame
  std::unordered_set<std::string> valueless_;            // frames whose edge has no value yet
  // Frames that are roots because their recorded parents, which these are, are below them. The
  // news of several owners come one after the other, so that those move next.
  std::map<std::string, std::string> cut_;
  // What is known of edges by their numbers, so that no names are looked up for each value.
  struct Settled {
    const Known* partition = nullptr;
    Handle frame{};
  };
  std::vector<Settled> settled_;
  std::vector<ToldSample> samples_;  // of the message that is applied; kept to reuse its memory
  std::size_t shared_by_ = 0;
  bool frames_changed_ = false;  // by the last message
};

}  // namespace tfdude::recording
