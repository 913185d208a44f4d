#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"

namespace tfdude {

/// What an identity may do. Each identity may also see the structure: the partitions, their frames
/// and parents.
struct Roles {
  std::optional<std::string> serves;  ///< the partition whose daemon it is
  bool look = false;                  ///< asks for values, joints and paths, and watches them
  std::set<std::string> move;         ///< partitions that it changes in any way; includes look
  std::set<std::string> stream;       ///< partitions to which it streams values and joints only
  bool observe = false;               ///< changes edges of all partitions; includes look
  bool clock = false;                 ///< publishes the time of external clocks

  friend bool operator==(const Roles& a, const Roles& b) {
    return a.serves == b.serves && a.look == b.look && a.move == b.move && a.stream == b.stream &&
           a.observe == b.observe && a.clock == b.clock;
  }
};

/// Checks whether a partition of this name can have keys.
/// @return kInvalidInput naming it: '/' in it, or a space at an end
[[nodiscard]] TFDUDE_EXPORT Result<void> check_partition_with_keys(const std::string& name);

/// Checks the partitions, and resolves what roles include: a daemon, and whoever changes something,
/// may look; who may move may also stream.
/// @return kInvalidInput naming the partition; also if nothing is allowed
[[nodiscard]] TFDUDE_EXPORT Result<Roles> complete(Roles roles);

/// The roles in words, one sentence each.
[[nodiscard]] TFDUDE_EXPORT std::vector<std::string> in_words(const Roles& roles);

}  // namespace tfdude
