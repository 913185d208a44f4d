#pragma once

#include <cstdint>
#include <string>

#include "partition/messages.hpp"
#include "runtime/deadline.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// The robot description that this process serves, and those of others.
/// @par Thread safety  All functions are thread-safe.
class Descriptions {
 public:
  /// @param own  empty: none
  Descriptions(Requests& requests, std::string own);

  [[nodiscard]] Reply answer(const Request& request) const;

  /// @return as Client::description()
  [[nodiscard]] Result<std::string> of(const std::string& partition, const Deadline& deadline);

 private:
  [[nodiscard]] Result<DescriptionPart> ask(const std::string& partition, std::uint64_t from,
                                            const Deadline& deadline);

  Requests& requests_;
  const std::string own_;
  const std::uint64_t hash_;
};

}  // namespace tfdude
