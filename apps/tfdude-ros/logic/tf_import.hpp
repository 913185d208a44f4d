#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/types/edge.hpp"

#include "../messages.hpp"
#include "names.hpp"
#include "stamps.hpp"

// What the transforms of ROS change in the partition that the bridge serves for them. No DDS, no
// threads and no clock.
namespace tfdude::ros {

/// Whose a frame is, in the domain of tf-dude.
struct Holding {
  enum class Kind : std::uint8_t {
    kNobody,
    kBridge,   ///< the partition that the bridge serves for /tf
    kOther,    ///< another partition, whether it is reachable or not
    kUnknown,  ///< it may belong to a partition that is not reachable
  };
  Kind kind = Kind::kNobody;
  std::string who{};  ///< the other partition, or why it is not known
};

/// Why transforms were not taken, and how many.
struct ImportCounts {
  std::uint64_t taken = 0;
  std::uint64_t names = 0;      ///< a name that cannot be an id
  std::uint64_t values = 0;     ///< not a rigid transform, or a frame in itself
  std::uint64_t owned = 0;      ///< the frame belongs to another partition, or may
  std::uint64_t contested = 0;  ///< another publisher gives the frame another parent
  std::uint64_t rejected = 0;   ///< by the partition: a cycle, too old...
  std::uint64_t timeless = 0;   ///< without a stamp, while the clock has no time yet
  std::uint64_t joined = 0;     ///< of an edge whose values come from another topic
};

struct ImportSettings {
  Choice frames;  ///< by the names in ROS
  std::string prefix;
  StatedCovariance covariance = StatedCovariance::unspecified();
  /// Edges that drift (EdgeTiming::drifts), and the density of their random walk: by the child's
  /// name in ROS.
  std::map<std::string, Covariance> drifts{};
};

class TfImport {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  using WhoHolds = std::function<Holding(const std::string& id)>;

  /// A change of the structure.
  struct Edit {
    enum class Kind : std::uint8_t {
      kAddRoot,  ///< a parent that no message has described
      kAdd,
      kMove,   ///< has another parent now, or has become static
      kClear,  ///< time has jumped back: its samples are dropped
    };
    Kind kind = Kind::kAdd;
    std::string id;
    std::string parent{};
    std::optional<Transform> X_PC{};
  };
  /// Values with one stamp. Without, they hold for all times; but those of edges that have samples
  /// are of the present, as the partition's clock says.
  struct Batch {
    std::optional<Time> stamp;
    std::vector<EdgeUpdate> edges;
  };
  /// Apply the edits first, in their order.
  struct Changes {
    std::vector<Edit> edits;
    std::vector<Batch> batches;
    std::vector<std::string> reports;  ///< each once, for the log
    /// How many batches there were when one last got a value of this frame.
    std::unordered_map<std::string, std::size_t> last_batches;

    [[nodiscard]] bool empty() const { return edits.empty() && batches.empty(); }
  };

  explicit TfImport(ImportSettings settings) : settings_(std::move(settings)) {}

  /// @param writer  its GUID
  /// @param arrival  the time of the partition's clock, for samples without a stamp; absent: it is
  ///   not known yet
  [[nodiscard]] Changes take(const TfMessage& message, const std::string& writer, bool is_static,
                             SteadyTime now, const WhoHolds& who_holds,
                             std::optional<Time> arrival = std::nullopt);

  /// Serves an edge whose value observations will determine, between two frames of ROS. From now on
  /// it has the same samples as the edges below it; each stands for no motion since the one before.
  /// Its values on /tf only tell their stamps. Without an effect if it is served so already.
  /// @param transform  the first sample, with a stamp; its covariance is unspecified
  [[nodiscard]] Changes hold(const TransformStamped& transform, SteadyTime now,
                             const WhoHolds& who_holds);

  /// Serves a static edge whose value observations will determine. What /tf says of it does not
  /// count. Without an effect if it is served so already.
  [[nodiscard]] Changes place(const TransformStamped& transform, SteadyTime now,
                              const WhoHolds& who_holds);

  /// Whether it has taken the values of a frame from another topic than /tf.
  [[nodiscard]] bool has_of_topic(const std::string& id) const {
    const auto entry = entries_.find(id);
    return entry != entries_.end() && entry->second.exists && entry->second.of_topic;
  }
  /// The partition has removed a frame.
  void forget(const std::string& id) { entries_.erase(id); }

  /// How a frame behaves in time, if not as all others do. Set it after each kAdd and kMove.
  [[nodiscard]] std::optional<EdgeTiming> timing_of(const std::string& id,
                                                    const EdgeTiming& usual) const;

  /// Static transforms come only once. Takes those again that were not taken because of their
  /// owner. Call when the structure has changed.
  [[nodiscard]] Changes retry(SteadyTime now, const WhoHolds& who_holds);

  /// Takes none of these frames, which another partition is about to serve: they replace those of
  /// the last call. What is below stays as it is.
  /// @return those that were taken before: the partition must release them
  [[nodiscard]] std::vector<std::string> give_up(std::set<std::string> frames);

  /// The partition did not apply a change of this frame. Unless only a stamp was wrong, it starts
  /// over with the next message.
  /// @return a report for the log, if it is the first of this kind
  [[nodiscard]] std::optional<std::string> rejected(const std::string& id, const Error& error);
  /// Likewise for a sample.
  [[nodiscard]] std::optional<std::string> rejected_sample(const std::string& id,
                                                           const Error& error);
  /// The partition has the very sample that it rejected for its stamp.
  void repeated_alike() { stamps_.same(); }

  [[nodiscard]] const ImportCounts& counts() const { return counts_; }
  [[nodiscard]] const StampReports& stamps() const { return stamps_; }

 private:
  struct Entry {
    bool exists = false;  // in the partition
    std::string parent;   // empty: only known as the parent of others
    bool is_static = false;
    std::string writer;     // of the newest transform
    SteadyTime heard{};     // when that came
    Time newest{};          // its stamp
    Pose X_PC{};            // if static
    bool shared = false;    // it was reported that it has several publishers
    bool of_topic = false;  // its values are not those of /tf
    bool observed = false;  // observations determine them

    // See hold(). X_PC is the value of each sample.
    [[nodiscard]] bool is_held() const { return observed && !is_static; }
  };
  struct HeldBack {
    TransformStamped transform;
    std::string writer;
  };
  /// One transform with checked names and numbers.
  struct Checked {
    std::string id;
    std::string parent;
    Transform X_PC;
    Time stamp;  // without one, that of the arrival
    bool is_static;
    bool is_stamped;
    bool of_topic;
  };

  void take_one(const TransformStamped& transform, const std::string& writer, bool is_static,
                SteadyTime now, const WhoHolds& who_holds, std::optional<Time> arrival,
                Changes& changes);
  void hold_back(const Checked& one, const TransformStamped& transform, const std::string& writer,
                 Changes& changes);
  [[nodiscard]] std::optional<Checked> check(const TransformStamped& transform, bool is_static,
                                             Changes& changes);
  /// Dates a sample without a stamp. @return whether that is possible
  [[nodiscard]] bool date(Checked& one, std::optional<Time> arrival, Changes& changes);
  [[nodiscard]] Holding holding(const std::string& id, const WhoHolds& who_holds) const;
  /// Whether the values of the frame come from another topic than /tf: then this one only says that
  /// there is data.
  [[nodiscard]] bool joins(const Checked& one, Changes& changes);
  /// Serves an edge that observations determine. @return the edge; null if it changes nothing
  [[nodiscard]] std::optional<Checked> serve(const TransformStamped& transform, bool is_static,
                                             SteadyTime now, const WhoHolds& who_holds,
                                             Changes& changes);
  /// Gives a held edge a sample.
  void extend(const std::string& id, Time stamp, Changes& changes);
  void end_hold(const std::string& id, Changes& changes);
  [[nodiscard]] bool may_take(const Checked& one, const std::string& writer,
                              const WhoHolds& who_holds, Changes& changes);
  [[nodiscard]] bool has_parent(const Checked& one, const WhoHolds& who_holds, Changes& changes);
  /// @return whether this writer decides about the frame now
  [[nodiscard]] bool may_write(const Checked& one, const std::string& writer, SteadyTime now,
                               Entry& entry, Changes& changes);
  void apply(const Checked& one, const std::string& writer, SteadyTime now, Entry& entry,
             Changes& changes);
  [[nodiscard]] static std::optional<Edit::Kind> edit_for(const Checked& one, const Entry& entry,
                                                          bool jumped);
  [[nodiscard]] const Covariance* drift_of(std::string_view id) const;
  void report_jump(const Checked& one, Time newest, SteadyTime now, Changes& changes);
  void report_once(const std::string& about, std::string text, Changes& changes);
  [[nodiscard]] bool is_first(const std::string& about);

  ImportSettings settings_;
  std::unordered_map<std::string, Entry> entries_;
  std::map<std::string, HeldBack> held_back_;  // static transforms, by the child's id
  std::set<std::string> given_up_;
  std::set<std::string> reported_;
  std::optional<SteadyTime> jump_reported_;
  ImportCounts counts_;
  StampReports stamps_;
};

}  // namespace tfdude::ros
