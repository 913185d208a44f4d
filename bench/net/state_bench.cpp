// The cost of storing the state: the same calls to an owner that stores it and to one that does
// not, in turns.
//
//   state_bench --profile FILE --domain-kept DOMAIN --domain-not DOMAIN --state DIR --calls N
//               --repetitions R
//
// Keys: state/WHAT/kept and state/WHAT/not: an own update by handle, an own add and remove, an
// update by request, an add and remove by request. The owner has 100 frames, and stores values
// every 20 ms, so that storing and calls overlap.

#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/node.hpp"

#include "net/harness.hpp"

namespace {

using bench::check;
using bench::must;
using tfdude::Client;
using tfdude::Node;
using tfdude::Transform;

constexpr int kFrames = 100;

struct Side {
  Side(tfdude::Options options, const std::string& state)
      : asker(must(Client::open(options), "join")), owner(open(std::move(options), state)) {}

  static Node open(tfdude::NodeOptions options, const std::string& state) {
    options.state = state;
    options.save_every = tfdude::Milliseconds(20);
    std::vector<tfdude::FrameSpec> frames{{"f0", "", {}}};
    for (int i = 1; i < kFrames; ++i) frames.push_back({"f" + std::to_string(i), "f0", {}});
    return must(Node::open("owner", frames, options), "serve");
  }

  Client asker;
  Node owner;
};

void compare(const std::string& what, Side& kept, Side& none, const bench::Extent& extent,
             int batch, void (*call)(Side&)) {
  bench::measure({bench::turn(
                      "state/" + what + "/kept", [&kept, call] { call(kept); }, batch),
                  bench::turn(
                      "state/" + what + "/not", [&none, call] { call(none); }, batch)},
                 extent);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): it should end the program
int main(int argc, char** argv) {
  const bench::Arguments arguments(argc, argv);
  Side kept(arguments.options("domain-kept"), arguments.text("state"));
  Side none(arguments.options("domain-not"), {});
  const bench::Extent extent{arguments.number("calls"), arguments.number("repetitions"), 100};
  compare("own_update", kept, none, extent, 100, [](Side& side) {
    static const Transform kX;
    check(side.owner.update("f7", kX), "update");
  });
  compare("own_add_remove", kept, none, extent, 20, [](Side& side) {
    check(side.owner.add("new", "f7", {}), "add");
    check(side.owner.remove("new"), "remove");
  });
  compare("update", kept, none, extent, 1,
          [](Side& side) { check(side.asker.update("f7", {}), "update"); });
  compare("add_remove", kept, none, extent, 1, [](Side& side) {
    check(side.asker.add("new", "f7", {}), "add");
    check(side.asker.remove("new"), "remove");
  });
  return 0;
}
