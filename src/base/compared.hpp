#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// Two durations of which a sentence says that one exceeds the other, for people: as readable(), or
/// in milliseconds where they would look the same.
[[nodiscard]] inline std::pair<std::string, std::string> compared(std::chrono::nanoseconds one,
                                                                  std::chrono::nanoseconds other) {
  std::pair<std::string, std::string> texts{readable(one), readable(other)};
  if (texts.first == texts.second) texts = {in_milliseconds(one), in_milliseconds(other)};
  return texts;
}

}  // namespace tfdude
