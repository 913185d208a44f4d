#include "transport/fastdds/access.hpp"

#include <chrono>

#include "tfdude/base/id.hpp"

#include "partition/requests.hpp"

namespace tfdude::fastdds {

Result<Access> Access::read(const std::string& directory, const std::string& partition) {
  if (directory.empty()) return Access();
  if (!partition.empty()) {
    if (auto ok = check_partition_with_keys(partition); !ok) return tl::unexpected(ok.error());
  }
  auto keys = find_keys(directory, std::chrono::system_clock::now());
  if (!keys) return tl::unexpected(std::move(keys.error()));
  const auto& serves = keys->roles.serves;
  if (!partition.empty() && serves != partition) {
    return fail(Errc::kNotPermitted,
                "identity " + quote(keys->identity) + " may not serve partition " +
                    quote(partition) + ": its keys are those of " +
                    (serves ? "the daemon of partition " + quote(*serves) : "a client"));
  }
  return Access(*std::move(keys));
}

void Access::secure(edds::DomainParticipantQos& qos) const {
  if (!keys_) return;
  const auto set = [&qos](const std::string& name, const std::string& value) {
    qos.properties().properties().emplace_back("dds.sec." + name, value);
  };
  const auto set_file = [&set](const std::string& name, const std::string& path) {
    set(name, "file://" + path);
  };
  set("auth.plugin", "builtin.PKI-DH");
  set_file("auth.builtin.PKI-DH.identity_ca", keys_->authority);
  set_file("auth.builtin.PKI-DH.identity_certificate", keys_->certificate);
  set_file("auth.builtin.PKI-DH.private_key", keys_->key);
  set_file("auth.builtin.PKI-DH.identity_crl", keys_->revoked);
  // As Fast DDS 2.9 announces the algorithms; 3.1 understands both.
  set("auth.builtin.PKI-DH.transmit_algorithms_as_legacy", "true");
  set("access.builtin.Access-Permissions.transmit_algorithms_as_legacy", "true");
  set("access.plugin", "builtin.Access-Permissions");
  set_file("access.builtin.Access-Permissions.permissions_ca", keys_->authority);
  set_file("access.builtin.Access-Permissions.governance", keys_->governance);
  set_file("access.builtin.Access-Permissions.permissions", keys_->permissions);
  set("crypto.plugin", "builtin.AES-GCM-GMAC");
}

tl::unexpected<Error> Access::refuse(const std::string& partition,
                                     const std::string& attempt) const {
  return fail(Errc::kNotPermitted, "identity " + quote(keys_->identity) + " may not " + attempt +
                                       " in partition " + quote(partition));
}

Result<void> Access::check(const std::string& partition, const Request& request) const {
  if (is_change(request) ? may_change(partition) : may_look()) return {};
  return refuse(partition, attempt_of(request));
}

Result<void> Access::check_stream(const std::string& partition) const {
  if (!keys_) return {};
  const Roles& roles = keys_->roles;
  if (roles.move.count(partition) > 0 || roles.stream.count(partition) > 0) return {};
  return refuse(partition, "stream");
}

Result<void> Access::check_watch(const std::string& partition) const {
  if (may_look()) return {};
  return refuse(partition, "watch paths");
}

Result<void> Access::check_clock() const {
  if (!keys_ || keys_->roles.clock) return {};
  return fail(Errc::kNotPermitted,
              "identity " + quote(keys_->identity) + " may not publish the time");
}

}  // namespace tfdude::fastdds
