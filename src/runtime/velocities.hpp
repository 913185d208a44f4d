#pragma once

#include <string>
#include <vector>

#include "tfdude/types/query.hpp"

#include "runtime/context.hpp"
#include "runtime/lookups.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// Mean velocities of frames. Client describes the return values.
/// @par Thread safety  All functions are thread-safe.
class Velocities {
 public:
  Velocities(const Context& context, Lookups& lookups)
      : structure_(context.structure), requests_(context.requests), lookups_(lookups) {}

  [[nodiscard]] Result<Velocity> velocity(const std::string& a, const std::string& b,
                                          const VelocityQuery& query, const Deadline& deadline);

 private:
  struct Interval {
    Time begin;
    Time end;
  };

  /// @param newest  the latest common time of the path
  [[nodiscard]] Result<Interval> interval(const std::string& a, const std::string& b,
                                          const VelocityQuery& query, Time newest,
                                          const Deadline& deadline);
  [[nodiscard]] Result<StampedTransform> lookup(const std::string& a, const std::string& b,
                                                const std::optional<Time>& at,
                                                const Deadline& deadline);

  Structure& structure_;
  Requests& requests_;
  Lookups& lookups_;
};

}  // namespace tfdude
