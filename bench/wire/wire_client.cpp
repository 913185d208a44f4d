// One long-lived client for bench/wire.py, which counts the traffic of each operation: discovery is
// complete before the first one.
//
//   wire_client DOMAIN PROFILE [CONFIG]
//
// With a configuration it is the owner of that partition.
//
// Reads operations from standard input, one per line:
//   add ID PARENT | remove ID | update ID | publish ID | joint NAME | lookup A B
// and answers each with "BEGIN done", or with "failed" and the reason. BEGIN is the time of its
// start by the system clock [ns], which captures use as well.

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/description/config.hpp"

namespace {

using namespace tfdude;

long long now_ns() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since).count();
}

Result<void> perform(Client& client, const std::string& line) {
  std::istringstream words(line);
  std::string operation;
  std::string first;
  std::string second;
  words >> operation >> first >> second;
  const Transform X = Transform::exact(Pose());  // with a covariance, as in the thesis
  if (operation == "add") return client.add(first, second, X);
  if (operation == "remove") return client.remove(first);
  if (operation == "update") return client.update(first, X);
  if (operation == "publish") return client.publish({{first, X}});
  if (operation == "joint") return client.publish_joints({first}, {0.5}, {1e-6});
  if (operation == "lookup") {
    if (auto found = client.lookup(first, second); !found) return tl::unexpected(found.error());
    return {};
  }
  return fail(Errc::kInvalidInput, "unknown operation: " + line);
}

Result<Node> open_owner(const char* file, const Options& options) {
  const auto config = load_config(file);
  if (!config) return tl::unexpected(config.error());
  return Node::open(config->partition, config->frames, options);
}

template <class Opened>
int run(Result<Opened> client) {
  if (!client) {
    std::cerr << client.error().message << '\n';
    return 1;
  }
  for (std::string line; std::getline(std::cin, line);) {
    const long long begin = now_ns();
    const auto done = perform(*client, line);
    if (done) {
      std::cout << begin << " done" << std::endl;
    } else {
      std::cout << "failed " << done.error().message << std::endl;
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::cerr << "usage: wire_client DOMAIN PROFILE [CONFIG]\n";
    return 2;
  }
  Options options;
  options.domain = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
  options.profile = argv[2];
  return argc == 4 ? run(open_owner(argv[3], options)) : run(Client::open(options));
}
