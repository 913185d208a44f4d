#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace tfdude::cli {

/// Adds the option for the format of another program's file.
inline CLI::Option* add_format(CLI::App& app, std::string& format, const char* help) {
  return app.add_option("--format", format, help)
      ->check(CLI::IsMember(
          {"kalibr", "eye-on-hand", "eye-on-base", "ros1", "ros2", "opencv", "colmap", "g2o"}));
}

}  // namespace tfdude::cli
