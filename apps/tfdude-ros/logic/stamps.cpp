#include "stamps.hpp"

#include <utility>

namespace tfdude::ros {

std::optional<std::string> StampReports::unstamped(const std::string& who,
                                                   const std::string& meaning) {
  ++counts_.unstamped;
  return once("unstamped " + who, who + ": its message has no stamp (0): " + meaning);
}

std::optional<std::string> StampReports::repeated(const std::string& who, const std::string& why) {
  ++counts_.repeated;
  return once("repeated " + who,
              "not taken: " + who + ": another value for a stamp that was there before: " + why);
}

std::optional<std::string> StampReports::old(const std::string& who, const std::string& why) {
  ++counts_.old;
  return once("old " + who, "not taken: " + who + ": " + why);
}

std::optional<std::string> StampReports::early(const std::string& who, const std::string& why) {
  ++counts_.early;
  return once("early " + who, "not taken: " + who + ": " + why);
}

std::string StampReports::summary() const {
  return "unstamped=" + std::to_string(counts_.unstamped) +
         " same=" + std::to_string(counts_.same) + " repeated=" + std::to_string(counts_.repeated) +
         " old=" + std::to_string(counts_.old) + " early=" + std::to_string(counts_.early);
}

std::optional<std::string> StampReports::once(const std::string& about, std::string text) {
  // What happens after that is only counted.
  constexpr std::size_t kMost = 1000;
  const bool is_first = reported_.size() < kMost && reported_.insert(about).second;
  return is_first ? std::optional<std::string>(std::move(text)) : std::nullopt;
}

}  // namespace tfdude::ros
