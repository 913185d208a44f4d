#pragma once

#include <string>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/keys/settings.hpp"

#include "keys/certificates.hpp"

namespace tfdude::keys {

/// So much may the clock of a host be behind.
inline constexpr std::chrono::hours kClockTolerance{24};

/// A certificate that the authority issued.
struct Issued {
  std::string serial;
  std::string identity;
  bool revoked = false;
};

/// The part of a key store that does not leave it.
struct Authority {
  std::string store;
  Pair pair;
  Validity validity;
  KeySettings settings;
  std::vector<Issued> issued;  ///< all certificates ever
};

[[nodiscard]] bool has_authority(const std::string& store);

/// Creates it in a store that has none.
[[nodiscard]] Result<void> create_authority(const std::string& store, const KeySettings& settings,
                                            const Validity& validity);

/// Reads it, and checks its files, and that it is valid.
[[nodiscard]] Result<Authority> open_authority(const std::string& store, Time now);

/// Stores which certificates it issued and revoked.
[[nodiscard]] Result<void> store_issued(const Authority& authority);

/// The list of revoked certificates, in PEM.
[[nodiscard]] Result<std::string> revoked_list(const Authority& authority, Time now);

}  // namespace tfdude::keys
