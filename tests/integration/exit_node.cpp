// A program whose client or node is still open when it exits, for exit_test.cpp:
//
//   exit_node DOMAIN PROFILE HOW
//
// Its exit status is 0, unless it crashes or hangs.

#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/client/watch.hpp"
#include "tfdude/transport/loopback.hpp"

namespace {

using namespace tfdude;

std::optional<Client> global;
std::unique_ptr<Client> owned;
std::optional<Node> node;
std::optional<PathWatch> watch;

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) return 2;
  ClientOptions options;
  options.domain = static_cast<std::uint32_t>(std::atoi(arguments[1]));
  options.profile = arguments[2];
  const std::string how = arguments[3];
  LoopbackNetwork network;
  std::optional<Result<Node>> before;
  if (how == "after loopback")
    before.emplace(Node::open(network.join(), "alone", {{"lamp", "", {}}}));
  if (how == "after an error") {
    ClientOptions wrong = options;
    wrong.profile = "/nowhere/profile.xml";
    if (Client::open(wrong)) return 8;
  }
  Result<Client> opened = Client::open(options);
  if (!opened) return 3;
  if (!opened->lookup("world", "robot_1", Query{}, Milliseconds(20000))) return 4;
  if (how == "exit") std::exit(0);
  if (how == "exit in a callback") {
    const Subscription changes = opened->on_change([](const Change&) { std::exit(0); });
    (void)opened->add("cup", "world", Transform());
    std::this_thread::sleep_for(std::chrono::seconds(20));
    return 5;
  }
  if (how == "optional" || how.rfind("after", 0) == 0) global.emplace(*std::move(opened));
  if (how == "unique") owned = std::make_unique<Client>(*std::move(opened));
  if (how == "watch") {
    auto watched = opened->watch("world", "robot_1", {}, Milliseconds(20000));
    if (!watched) return 6;
    watch.emplace(*std::move(watched));
    global.emplace(*std::move(opened));
  }
  if (how == "node") {
    NodeOptions own;
    own.domain = options.domain;
    own.profile = options.profile;
    auto served = Node::open("exits", {{"lamp", "world", {}}}, own);
    if (!served) return 7;
    node.emplace(*std::move(served));
  }
  return 0;
}
