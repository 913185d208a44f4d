#pragma once

#include <memory>
#include <sstream>
#include <string>

#include <spdlog/sinks/ostream_sink.h>

#include "base/log.hpp"

namespace tfdude::testing {

/// Captures the log while it exists. No other thread may log when it begins or ends.
class CapturedLog {
 public:
  CapturedLog() { log().sinks().push_back(sink_); }
  ~CapturedLog() { log().sinks().pop_back(); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;

  /// How often a text occurs.
  [[nodiscard]] int count(const std::string& what) const {
    const std::string all = text_.str();
    int found = 0;
    for (auto at = all.find(what); at != std::string::npos; at = all.find(what, at + 1)) ++found;
    return found;
  }
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  const spdlog::sink_ptr sink_ = std::make_shared<spdlog::sinks::ostream_sink_mt>(text_);
};

}  // namespace tfdude::testing
