#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "tfdude/base/time.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// A frame by number: found once by id, then used without hashing. Stands for this one frame of this one forest until
/// it is removed; a later frame of the same id gets another handle, and to other forests of the process it is that of no
/// frame.
struct Handle {
  std::uint32_t slot = 0;
  std::uint32_t generation = 0;
};

/// A new value X_PC for the edge named by its child's id.
struct EdgeUpdate {
  std::string id;
  Transform X_PC;
};

/// The same by number.
struct HandleUpdate {
  Handle frame;
  Transform X_PC;
};

/// Parts of a new value X_PC for the edge named by its child's id; those that are absent stay as they are.
struct PartialUpdate {
  std::string id;
  std::optional<Eigen::Vector3d> translation{};  ///< [m]
  std::optional<Eigen::Quaterniond> rotation{};
  std::optional<Covariance> covariance{};
};

/// How an edge behaves in time.
struct EdgeTiming {
  /// How much of its history is kept: samples that are not older than this before the newest,
  std::chrono::nanoseconds span = std::chrono::seconds(10);
  /// and no more than so many; at least 2.
  std::size_t count = 2048;
  /// How much the edge may have strayed from the geodesic between two samples, or from its last value: covariance
  /// a second. Between samples at distance Δt, a of the way: a (1-a) Δt Q, as of a Brownian bridge.
  Covariance process_noise{};
  /// It is moving from its first update on; else from the first that is given a stamp.
  bool moving = false;
  /// Samples further ahead of the owner's clock than this are refused; max(): none are.
  std::chrono::nanoseconds max_ahead = std::chrono::seconds(60);
  /// So many samples in a row that are older than the span, each younger than the one before, start the history again: the
  /// clock of their source has jumped back. 0: never.
  std::size_t restart_after = 5;
};

/// What is kept of one edge's history.
struct HistoryInfo {
  std::string id;
  std::size_t samples = 0;
  std::size_t bytes = 0;
  std::chrono::nanoseconds span_limit{0};
  std::size_t count_limit = 0;
  std::optional<Time> oldest;
  std::optional<Time> newest;
  std::chrono::nanoseconds mean_gap{0};  ///< between samples
  std::chrono::nanoseconds max_gap{0};
  std::chrono::nanoseconds jitter{0};  ///< standard deviation of the gaps
  std::uint64_t refused_old = 0;       ///< samples that were older than what is kept,
  std::uint64_t refused_equal = 0;     ///< or of the stamp of another,
  std::uint64_t refused_ahead = 0;     ///< or too far ahead of the owner's clock
};

/// What observations have said of one edge's covariance so far.
struct EdgeConsistency {
  std::string id;
  std::uint64_t observations = 0;
  std::uint64_t refused = 0;  ///< of these, by the gate
  NormalizedInnovation sum;   ///< over all of them
};

}  // namespace tfdude
