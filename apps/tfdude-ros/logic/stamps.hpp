#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "tfdude/base/time.hpp"

// What the stamps of messages mean, the same for /tf, joints and poses. No DDS, no threads and no
// clock.
namespace tfdude::ros {

/// A stamp of zero is one that was not set, also to tf2, where it means the latest: the value is
/// that of an update without a stamp.
[[nodiscard]] inline std::optional<Time> given_stamp(Time header) {
  return header == Time() ? std::nullopt : std::optional<Time>(header);
}

/// Counts what is unusual about stamps, and writes a text about it for the log, once for each name.
class StampReports {
 public:
  struct Counts {
    std::uint64_t unstamped = 0;  ///< taken as of the time of arrival
    std::uint64_t same = 0;       ///< repeats of a value with its stamp; they change nothing
    std::uint64_t repeated = 0;   ///< ignored: another value for a stamp that was there before
    std::uint64_t old = 0;        ///< ignored: older than the history
    std::uint64_t early = 0;  ///< ignored: negative, or of the time before the clock jumped back
  };

  /// @param who  as in "frame 'base'". @param meaning  what is done with its values
  [[nodiscard]] std::optional<std::string> unstamped(const std::string& who,
                                                     const std::string& meaning);
  /// The first value for a stamp stays, as in tf2. @param why  with the stamp
  [[nodiscard]] std::optional<std::string> repeated(const std::string& who, const std::string& why);
  [[nodiscard]] std::optional<std::string> old(const std::string& who, const std::string& why);
  [[nodiscard]] std::optional<std::string> early(const std::string& who, const std::string& why);
  void same() { ++counts_.same; }

  [[nodiscard]] const Counts& counts() const { return counts_; }
  /// "unstamped=1 same=0 repeated=2 old=0 early=0".
  [[nodiscard]] std::string summary() const;

 private:
  [[nodiscard]] std::optional<std::string> once(const std::string& about, std::string text);

  Counts counts_;
  std::set<std::string> reported_;
};

}  // namespace tfdude::ros
