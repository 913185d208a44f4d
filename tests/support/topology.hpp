#pragma once

#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/random.hpp"

namespace tfdude::testing {

/// One partition and the frames that its daemon starts with.
struct PartitionSpec {
  std::string name;
  std::vector<FrameSpec> frames;

  /// As a daemon's configuration, without loss of digits.
  [[nodiscard]] std::string yaml() const;
};

/// Five partitions of two or three frames, in one tree, with random edges. The first has the root.
/// @param star  all others are below the first; otherwise each is below the one before
[[nodiscard]] std::vector<PartitionSpec> five_partitions(Random& random, bool star);

}  // namespace tfdude::testing
