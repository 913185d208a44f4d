#pragma once

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "runtime/context.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// Advances the time of all owners with an external clock together, for simulators.
/// @par Thread safety  All functions are thread-safe.
class Advances {
 public:
  explicit Advances(const Context& context)
      : structure_(context.structure),
        transport_(context.transport),
        discovery_(context.discovery),
        requests_(context.requests) {}

  /// Whether the external clock of this process shows the time of a TimeRequest.
  [[nodiscard]] Reply answer(const Request& request) const;

  /// Waits until the clocks of all other owners show a time that was published, which is repeated
  /// for those that have not got it. @return as Client::advance_to()
  [[nodiscard]] Result<void> await_others(Time time, const Deadline& deadline);

 private:
  /// Of owners that do not show the time. @return the error of one that does not answer
  [[nodiscard]] Result<std::vector<Part>> still_late(std::vector<Part> asked,
                                                     const Deadline& deadline);

  Structure& structure_;
  Transport& transport_;
  Discovery& discovery_;
  Requests& requests_;
};

}  // namespace tfdude
