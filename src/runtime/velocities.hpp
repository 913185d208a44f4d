#pragma once

#include <string>
#include <vector>

#include "tfdude/types/query.hpp"

#include "runtime/lookups.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"

namespace tfdude {

/// Mean velocities of frames. Client describes the return values.
/// @par Thread safety  All functions are thread-safe.
class Velocities {
 public:
  Velocities(Structure& structure, Requests& requests, Lookups& lookups)
      : structure_(structure), requests_(requests), lookups_(lookups) {}

  [[nodiscard]] Result<Velocity> velocity(const std::string& a, const std::string& b,
                                          const VelocityQuery& query, const Deadline& deadline);

 private:
  struct Interval {
    Time begin;
    Time end;
  };

  /// Empty: the path is static.
  [[nodiscard]] Result<std::optional<Interval>> interval(const std::string& a, const std::string& b,
                                                         const VelocityQuery& query,
                                                         const Deadline& deadline);

  Structure& structure_;
  Requests& requests_;
  Lookups& lookups_;
};

}  // namespace tfdude
