#pragma once

#include <optional>
#include <string>
#include <utility>

#include "tfdude/base/result.hpp"
#include "tfdude/keys/key_files.hpp"

#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// What this participant may do, as its keys say; without keys, everything. Other participants
/// enforce it, so it is checked here only to return a clear error at once.
/// @par Thread safety  All const functions are thread-safe.
class Access {
 public:
  Access() = default;
  explicit Access(KeyFiles keys) : keys_(std::move(keys)) {}

  /// Reads the keys in this directory; empty: none.
  /// @param partition  that the participant is going to serve; empty: none
  /// @return kConfig naming the file; kNotPermitted if they are not of this partition's daemon
  [[nodiscard]] static Result<Access> read(const std::string& directory,
                                           const std::string& partition);

  /// Makes a participant use the keys.
  void secure(edds::DomainParticipantQos& qos) const;

  /// Identifies the authority in announcements: the number in its name; empty: no keys.
  [[nodiscard]] std::string authority() const {
    return keys_ ? keys_->authority_name.substr(keys_->authority_name.rfind(' ') + 1) : "";
  }

  /// Whether all messages are encrypted, those of discovery excepted.
  [[nodiscard]] bool encrypts() const { return keys_ && keys_->settings.encrypt; }

  [[nodiscard]] bool may_look() const { return !keys_ || keys_->roles.look; }
  [[nodiscard]] bool may_change(const std::string& partition) const {
    return !keys_ || keys_->roles.observe || keys_->roles.move.count(partition) > 0;
  }

  // @return kNotPermitted naming the identity, the partition and what was tried
  [[nodiscard]] Result<void> check(const std::string& partition, const Request& request) const;
  [[nodiscard]] Result<void> check_stream(const std::string& partition) const;
  [[nodiscard]] Result<void> check_watch(const std::string& partition) const;
  [[nodiscard]] Result<void> check_clock() const;

 private:
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& partition,
                                             const std::string& attempt) const;

  std::optional<KeyFiles> keys_;
};

}  // namespace tfdude::fastdds
