#include "base/log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace tfdude {

spdlog::logger& log() {
  static const std::shared_ptr<spdlog::logger> kLogger = [] {
    auto registered = spdlog::get("tfdude");
    if (registered) return registered;
    auto own = spdlog::stderr_color_mt("tfdude");
    own->set_level(spdlog::level::warn);
    return own;
  }();
  return *kLogger;
}

}  // namespace tfdude
