#pragma once

#include <functional>
#include <string>

#include <CLI/CLI.hpp>

#include "tfdude/transport/fastdds.hpp"
#include "tfdude/types/options.hpp"

namespace tfdude::cli {

/// Adds those of the options below that say which domain is joined.
inline void add_domain_options(CLI::App& app, Options& options) {
  app.add_option("--domain", options.domain, "DDS domain, 0 to 232 (else $TFDUDE_DOMAIN, else 0)")
      ->check(CLI::Range(0, 232));
  auto* profile = app.add_option("--profile", options.profile,
                                 "XML file of DDS profiles (else $TFDUDE_PROFILE)");
  app.add_flag_callback(
         "--local", [&options] { options.profile = kLocalProfile; },
         "this computer only, as --profile local: UDP over 127.0.0.1")
      ->excludes(profile);
}

/// Adds the options of discovery and the network. The environment provides those that are not given
/// (Options).
inline void add_network_options(CLI::App& app, Options& options) {
  add_domain_options(app, options);
  app.add_option("--keys", options.keys,
                 "directory of an identity, see tfdude keys (else $TFDUDE_KEYS)");
  app.add_flag_callback(
      "--no-shared-memory", [&options] { options.shared_memory = false; },
      "neither read the memory of other processes nor let them read (or "
      "TFDUDE_SHARED_MEMORY=off)");
  app.add_option("--discovery-server", options.discovery_server,
                 "HOST:PORT of a Fast DDS discovery server")
      ->check([](const std::string& text) {
        const auto good = check_discovery_server(text);
        return good ? std::string() : good.error().message;
      });
}

/// Adds the option of the clock.
inline void add_clock_option(CLI::App& app, const std::function<void(ClockKind)>& choose) {
  app.add_option_function<std::string>(
         "--clock",
         [choose](const std::string& kind) {
           choose(kind == "external" ? ClockKind::kExternal : ClockKind::kSystem);
         },
         "the clock of stamps: the system's, or an external one, whose time is published on "
         "tfdude/clock")
      ->check(CLI::IsMember({"system", "external"}));
}

}  // namespace tfdude::cli
