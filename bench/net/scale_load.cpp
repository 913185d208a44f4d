// Calls that concern only the second of the daemons that bench/scaling.py starts: frames added
// below its first frame, or lookups of that frame. Other daemons that are woken by them are not
// involved. Or a client that says when it knows its frames, and is idle until its input ends.

#include <cstdio>
#include <string>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>

#include "tfdude/client/client.hpp"

namespace {

int failed(const tfdude::Error& error) {
  std::fprintf(stderr, "scale_load: %s\n", error.message.c_str());
  return 1;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): it should end the program
int main(int argc, char** argv) {
  std::string mode;
  int calls = 0;
  int timeout_ms = 0;
  std::vector<std::string> follow;
  tfdude::ClientOptions options;
  options.shared_memory = false;  // as in harness.cpp
  CLI::App app{"calls for one daemon"};
  app.add_option("mode", mode)->required()->check(CLI::IsMember({"add", "lookup", "idle"}));
  app.add_option("--calls", calls)->required();
  app.add_option("--follow", follow, "follow only these trees");
  app.add_option("--domain", options.domain)->required();
  app.add_option("--timeout", timeout_ms)->required();
  app.add_option("--profile", options.profile)->required();
  app.add_option("--discovery-server", options.discovery_server);
  CLI11_PARSE(app, argc, argv);
  options.timeout = tfdude::Milliseconds(timeout_ms);
  if (!follow.empty()) options.follow = follow;
  auto client = tfdude::Client::open(options);
  if (!client) return failed(client.error());
  for (int i = 0; i < calls; ++i) {
    if (mode == "add") {
      // Each run uses new names.
      const std::string id = "added_" + std::to_string(getpid()) + "_" + std::to_string(i);
      const auto added = client->add(id, "p1_0", {});
      if (!added) return failed(added.error());
    } else {
      const auto X = client->lookup("p0_0", "p1_0");
      if (!X) return failed(X.error());
    }
  }
  if (mode == "idle") {
    // That a frame does not exist is certain once all, or all that is followed, are known.
    const auto none = client->parent("nowhere");
    if (none || none.error().code != tfdude::Errc::kUnknownFrame) return failed(none.error());
    std::puts("knows its frames");
    std::fflush(stdout);
    while (std::getchar() != EOF) {
    }
  }
  return 0;
}
