// Requests without keys, with signed messages and with encrypted ones, in turns.
//
//   secured_bench --profile FILE --calls N --repetitions R --domain-plain DOMAIN
//                 --domain-signed DOMAIN --keys-signed DIR
//                 --domain-encrypted DOMAIN --keys-encrypted DIR
//
// In each domain a tfduded owns chain_0 and chain_1. Keys: secured/lookup/HOW, secured/update/HOW.

#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"

#include "net/harness.hpp"

namespace {

using bench::check;
using bench::must;
using tfdude::Client;

struct Side {
  std::string how;
  Client client;
};

Side open(const bench::Arguments& arguments, const std::string& how) {
  tfdude::Options options = arguments.options("domain-" + how);
  if (how != "plain") options.keys = arguments.text("keys-" + how);
  Side side{how, must(Client::open(options), "join")};
  (void)bench::await_lookup(side.client, "chain_0", "chain_1");
  return side;
}

void compare(const std::string& what, std::vector<Side>& sides, const bench::Extent& extent,
             void (*call)(Client&)) {
  std::vector<bench::Turn> turns;
  for (Side& side : sides) {
    turns.push_back(bench::turn("secured/" + what + "/" + side.how,
                                [&client = side.client, call] { call(client); }));
  }
  bench::measure(std::move(turns), extent);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): it should end the program
int main(int argc, char** argv) {
  const bench::Arguments arguments(argc, argv);
  std::vector<Side> sides;
  for (const char* how : {"plain", "signed", "encrypted"}) sides.push_back(open(arguments, how));
  const bench::Extent extent{arguments.number("calls"), arguments.number("repetitions"), 100};
  compare("lookup", sides, extent,
          [](Client& client) { check(client.lookup("chain_0", "chain_1"), "lookup"); });
  compare("update", sides, extent,
          [](Client& client) { check(client.update("chain_1", {}), "update"); });
  return 0;
}
