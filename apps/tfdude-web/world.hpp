#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/partition_news.hpp"

#include "wire.hpp"

namespace tfdude::web {

/// A frame, with the newest value of its edge and some seconds of earlier ones.
struct ShownFrame {
  struct Sample {
    Time stamp;
    Pose pose;
    std::shared_ptr<const StatedCovariance> covariance;
  };

  std::string id;
  std::string parent;  ///< empty: a root
  bool has_value = false;
  Pose pose;
  /// With the shares of common errors, so that nothing looks better known than it is.
  std::shared_ptr<const StatedCovariance> covariance;
  bool correlated = false;
  std::optional<Time> stamp;
  /// The pictures that first contained this pose, and this covariance.
  std::uint64_t changed = 0;
  std::uint64_t covariance_changed = 0;
  std::deque<Sample> past;
};

/// A frame's place among all, and its pose and covariance at one instant.
struct PlacedFrame {
  const ShownFrame* frame;
  std::int64_t parent;  ///< index, or -1
  Transform X_RC;       ///< in the root of its tree
  std::uint32_t root;   ///< index
  bool known;           ///< all edges up to the root have values
};

/// What the pages show: all frames of all watched partitions. Changes are collected in pictures,
/// with consecutive numbers. Thread-safe.
class World {
 public:
  /// From a watch, on any thread.
  void receive(const PartitionNews& news);
  /// Drops a partition that was forgotten.
  void drop(const std::string& partition);

  /// Ends the picture that collects changes. @return its number
  std::uint64_t end_picture();

  /// The number of the structure; it changes with frames, owners and their reachability.
  [[nodiscard]] std::uint32_t structure() const;
  /// Numbers the structure as another world did that had the same, or anew.
  void number_structure(std::uint32_t structure);
  /// What a page is sent of the structure.
  [[nodiscard]] nlohmann::json structure_json() const;

  /// What changed in pictures after one; empty if nothing has. A page that has seen nothing passes
  /// zero.
  [[nodiscard]] std::string values_since(std::uint64_t picture, Time now) const;
  [[nodiscard]] std::string covariances_since(std::uint64_t picture, Time now) const;
  /// Both messages for an instant. Frames without a value there are left out.
  [[nodiscard]] std::vector<std::string> at(Time instant) const;
  /// Both messages of all newest values, as those of an instant that was asked for.
  [[nodiscard]] std::vector<std::string> newest(Time now) const;
  /// The oldest instant that is kept, and the newest stamp.
  [[nodiscard]] std::optional<std::pair<Time, Time>> span() const;

  /// Calls the function for all frames, parents first.
  void each_placed(const std::function<void(const PlacedFrame&, std::uint32_t)>& see) const;
  /// Calls the function for the frames whose values changed after a picture.
  void each_changed(std::uint64_t picture, const std::function<void(const ShownFrame&)>& see) const;

 private:
  struct Shown {
    bool reachable = false;
    std::string why;
    std::vector<std::string> order;  ///< ids by the index of the news
    std::map<std::string, ShownFrame> frames;
  };

  void take(Shown& partition, const FramesNews& news);
  void take(Shown& partition, const ValuesNews& news);
  void keep(ShownFrame& frame, const WatchedValue& value);
  void rebuild();
  [[nodiscard]] Message values(std::uint64_t picture, Time now, bool past) const;
  [[nodiscard]] Message covariances(std::uint64_t picture, Time now, bool past) const;
  [[nodiscard]] std::optional<std::uint32_t> index_of(const std::string& id) const;

  mutable std::mutex mutex_;
  std::map<std::string, Shown> partitions_;
  std::uint32_t structure_ = 1;
  std::uint64_t picture_ = 1;
  std::size_t most_past_ = 0;  ///< samples kept of an edge
  // All frames by index, and where each id is.
  std::vector<ShownFrame*> all_;
  std::vector<std::uint32_t> owners_;
  std::map<std::string, std::uint32_t> places_;
};

}  // namespace tfdude::web
