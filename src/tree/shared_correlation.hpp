#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"

#include "tree/arena.hpp"

namespace tfdude {

/// What lookups need of a correlation, in one block that refers to nothing else, so that other
/// processes can copy and check it. The common errors follow.
struct FlatCorrelation {
  std::uint32_t bytes = 0;  ///< with what follows
  std::uint32_t common_errors = 0;
  std::uint32_t unknown = 0;
  std::uint32_t observed = 0;  ///< it was observed with other edges

  /// Before the columns of the loading, and then the name.
  struct Entry {
    std::uint32_t columns = 0;
    std::uint32_t name_bytes = 0;
    std::uint64_t subtracts = 0;
  };
  /// More than any correlation takes.
  static constexpr std::uint32_t kMostBytes = std::uint32_t{1} << 18U;
};

/// Reads a block whose bytes may be anything.
/// @param bytes  of the block
/// @param most  how many common errors there may be; reduced by those that there are
/// @param found  output; those that an edge was observed with have no names
/// @return false: it is no correlation
[[nodiscard]] bool read_flat(const char* block, std::size_t bytes, std::size_t& most,
                             Correlation& found);

/// A correlation for readers of this process and, if others read the memory, for those. Immutable.
class SharedCorrelation {
 public:
  SharedCorrelation() = default;
  SharedCorrelation(Arena& arena, Correlation correlation);
  ~SharedCorrelation();
  SharedCorrelation(const SharedCorrelation&) = delete;
  SharedCorrelation& operator=(const SharedCorrelation&) = delete;

  [[nodiscard]] bool exists() const { return own_.get() != nullptr; }
  const Correlation& operator*() const { return *own_.get(); }
  const Correlation* operator->() const { return own_.get(); }

  /// For other processes: an address of the owner; null: it does not exist.
  [[nodiscard]] const FlatCorrelation* const& flat() const { return flat_; }
  /// Memory besides this object.
  [[nodiscard]] std::size_t bytes() const;

 private:
  Veiled<Arena> arena_;
  VeiledOwner<const Correlation> own_;
  const FlatCorrelation* flat_ = nullptr;
};

/// How an edge's error is correlated with others. Immutable, shared by the edge's versions.
class EdgeCorrelation {
 public:
  EdgeCorrelation(Arena& arena, Correlation said) : arena_(&arena), said_(arena, std::move(said)) {}
  /// @param now  after observations, until the next update
  EdgeCorrelation(Arena& arena, Correlation said, Correlation now)
      : arena_(&arena), said_(arena, std::move(said)), now_(arena, std::move(now)) {}

  [[nodiscard]] const Correlation& said() const { return *said_; }
  [[nodiscard]] const Correlation& now() const { return revised() ? *now_ : *said_; }
  /// Whether the two may differ.
  [[nodiscard]] bool revised() const { return now_.exists(); }

  // For other processes, as SharedCorrelation::flat().
  [[nodiscard]] const FlatCorrelation* const& flat_said() const { return said_.flat(); }
  [[nodiscard]] const FlatCorrelation* const& flat_now() const { return now_.flat(); }

  [[nodiscard]] Arena& arena() const { return *arena_; }
  std::uint64_t retire_tag = 0;

 private:
  const Veiled<Arena> arena_;
  const SharedCorrelation said_;
  const SharedCorrelation now_;
};

/// Of a watcher, who is not told which samples were observed, nor how they were given.
enum class Told : std::uint8_t {
  kNot,      ///< it is its owner's
  kAsGiven,  ///< how it was given follows from what was told
  kGuessed,  ///< it was corrected when it was told first, so that this is not known
};

/// The place of a sample among those of an edge that drifts, in the joint covariance of what was
/// observed. Stamps: INT64_MIN is none.
struct RowInfo {
  bool observed = false;  ///< itself; otherwise it follows from one that was
  bool between = false;   ///< of an observation between two samples: none was given for the stamp
  /// How long, and how many, rows are kept (sample_rows.hpp); 0: this one only.
  std::uint8_t lasts = 0;
  Told told = Told::kNot;
  std::int64_t follows = INT64_MIN;  ///< stamp of the last observed sample, from which it follows
  std::int64_t before = INT64_MIN;   ///< stamp of the row before this one that is kept, too
};

/// What an observation has made of a sample: its error is one row of the joint covariance of all
/// that was observed then (a delayed state), while the samples around it stay as they were given.
struct SampleRevision {
  Transform given;          ///< the sample before all observations
  Correlation correlation;  ///< of this sample, instead of what is said of the edge
  RowInfo row{};
};

/// The same, for all who read the sample.
class SharedRevision {
 public:
  SharedRevision(Arena& arena, SampleRevision revision)
      : given(revision.given),
        row(revision.row),
        shared_(arena, std::move(revision.correlation)),
        arena_(&arena) {}

  const Transform given;
  const RowInfo row;  ///< for the owner only, except for `observed` and `follows`
  [[nodiscard]] const Correlation& correlation() const { return *shared_; }
  [[nodiscard]] const FlatCorrelation* const& flat() const { return shared_.flat(); }
  [[nodiscard]] std::size_t bytes() const { return sizeof(*this) + shared_.bytes(); }
  [[nodiscard]] Arena& arena() const { return *arena_; }

 private:
  const SharedCorrelation shared_;
  const Veiled<Arena> arena_;
};

}  // namespace tfdude
