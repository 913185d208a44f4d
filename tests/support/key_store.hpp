#pragma once

#include <chrono>
#include <fstream>
#include <iterator>
#include <string>

#include "tfdude/keys/key_store.hpp"

#include "support/process.hpp"

namespace tfdude::testing {

[[nodiscard]] inline std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Any time, so that nothing depends on the clock.
inline const Time kKeysTime = std::chrono::system_clock::from_time_t(1'900'000'000);

[[nodiscard]] inline Roles looking() {
  Roles roles;
  roles.look = true;
  return roles;
}

[[nodiscard]] inline Roles moving(const std::string& partition) {
  Roles roles;
  roles.move = {partition};
  return roles;
}

[[nodiscard]] inline Roles streaming(const std::string& partition) {
  Roles roles;
  roles.stream = {partition};
  return roles;
}

[[nodiscard]] inline Roles observing() {
  Roles roles;
  roles.observe = true;
  return roles;
}

[[nodiscard]] inline Roles daemon_of(const std::string& partition) {
  Roles roles;
  roles.serves = partition;
  return roles;
}

/// A key store in a temporary directory.
class TestKeys {
 public:
  /// @throws std::runtime_error if it cannot be created.
  explicit TestKeys(Time now = kKeysTime, const KeySettings& settings = {},
                    Days lifetime = kAuthorityLifetime)
      : now_(now) {
    const auto created = create_key_store(path(), settings, lifetime, now);
    if (!created) throw std::runtime_error(created.error().message);
  }

  [[nodiscard]] std::string path() const { return directory_.path() + "/keys"; }
  [[nodiscard]] std::string path(const std::string& identity) const {
    return path() + "/" + identity;
  }

  /// @throws std::runtime_error if it cannot be created.
  KeyFiles add(const std::string& name, const Roles& roles,
               Days lifetime = kIdentityLifetime) const {  // NOLINT(modernize-use-nodiscard)
    auto added = add_identity(path(), name, roles, lifetime, now_);
    if (!added) throw std::runtime_error(added.error().message);
    return *std::move(added);
  }

 private:
  TemporaryDirectory directory_;
  Time now_;
};

}  // namespace tfdude::testing
