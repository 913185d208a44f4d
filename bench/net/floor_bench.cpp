// Remote calls of tf-dude compared with their lower bounds: a bare Fast DDS round trip with the
// same QoS, and a bare UDP round trip. All have the same payload bytes in each direction, and take
// turns.
//
//   floor_bench --placement one_core|two_cores --central DOMAIN --domain DOMAIN --udp-port PORT
//               --profile FILE --calls N --repetitions R
//
// A tfduded in CENTRAL owns the example tree; a floor_echo is in DOMAIN and at PORT. Keys:
// floor/CALL/WHO/PLACEMENT. The sizes are those of our own messages, as our codec serializes them.

#include <cstdint>
#include <cstdio>
#include <string>

#include "net/floor_dds.hpp"
#include "net/harness.hpp"
#include "net/udp.hpp"

namespace {

using bench::must;
using tfdude::Client;
using tfdude::Transform;

constexpr const char* kPartition = "central";
constexpr const char* kFrame = "hand_left";
constexpr const char* kFrom = "arm_1";

class UdpPing {
 public:
  explicit UdpPing(int port) : port_(static_cast<std::uint16_t>(port)) {}

  void call(const bench::Sizes& sizes) {
    socket_.ask(port_, ++number_, sizes.request, sizes.reply);
    while (socket_.await_reply() != number_) continue;
  }

 private:
  std::uint16_t port_;
  std::uint32_t number_ = 0;
  bench::UdpSocket socket_;
};

}  // namespace

int main(int argc, char** argv) {
  const bench::Arguments arguments(argc, argv);
  auto client = must(Client::open(arguments.options("central")), "a client");
  const Transform X = bench::await_lookup(client, kFrom, kFrame);
  bench::DdsPing dds(static_cast<std::uint32_t>(arguments.number("domain")),
                     arguments.text("profile"));
  UdpPing udp(arguments.number("udp-port"));

  const auto compare = [&](const std::string& what, const bench::Sizes& sizes, auto ours) {
    const auto key = [&](const char* who) {
      return "floor/" + what + "/" + who + "/" + arguments.text("placement");
    };
    std::fprintf(stderr, "%s: %u bytes there, %u back\n", what.c_str(), sizes.request, sizes.reply);
    dds.prepare(sizes);
    bench::measure({bench::turn(key("ours"), ours), bench::turn(key("dds"), [&] { dds.call(); }),
                    bench::turn(key("udp"), [&] { udp.call(sizes); })},
                   {arguments.number("calls"), arguments.number("repetitions")});
  };
  compare("update",
          bench::sizes_of({1, kFrame, tfdude::UpdateRequest{{{kFrame, X}}}}, kPartition,
                          {1, 0, tfdude::Done{}}),
          [&] { bench::check(client.update(kFrame, X), "update"); });
  compare("lookup",
          bench::sizes_of({1, kFrame, tfdude::LookupRequest{{{kFrom, kFrame}}}}, kPartition,
                          {1, 0, tfdude::SegmentValues{{{X}}, {}, {}, {}}}),
          [&] { bench::check(client.lookup(kFrom, kFrame), "lookup"); });
  return 0;
}
