// Remote calls of tf-dude compared with their lower bounds: a bare Fast DDS round trip with the
// same QoS, and a bare UDP round trip. All have the same payload bytes in each direction, and take
// turns.
//
//   floor_bench --placement one_core|two_cores --central DOMAIN --domain DOMAIN --udp-port PORT
//               --profile FILE --calls N --repetitions R
//
// A tfduded in CENTRAL owns the example tree; a floor_echo is in DOMAIN and at PORT. Keys:
// floor/CALL/WHO/PLACEMENT. The sizes are those of our own messages, as our codec serializes them.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>

#include "net/floor_dds.hpp"
#include "net/harness.hpp"
#include "net/udp.hpp"
#include "transport/fastdds/codec.hpp"

namespace {

namespace edds = tfdude::fastdds::edds;
namespace wire = tfdude::wire;
using bench::must;
using tfdude::Client;
using tfdude::Transform;

constexpr const char* kPartition = "central";
constexpr const char* kFrame = "hand_left";
constexpr const char* kFrom = "arm_1";

/// CDR payloads of one kind of call.
struct Sizes {
  std::uint32_t request;
  std::uint32_t reply;
};

Sizes sizes_of(const tfdude::Request& request, const tfdude::Reply& reply) {
  namespace codec = tfdude::fastdds;
  return {bench::payload_size<wire::RequestPubSubType>(codec::to_wire(request, kPartition)),
          bench::payload_size<wire::ReplyPubSubType>(codec::to_wire(reply))};
}

/// Writes, and waits for the listener of the reply's reader, as tf-dude's client does.
class DdsPing final : public edds::DataReaderListener {
 public:
  DdsPing(std::uint32_t domain, const std::string& profile)
      : endpoints_(domain, profile, bench::kPingTopic, bench::kPongTopic, *this, "call") {
    bench::await_match(endpoints_);
  }

  void prepare(const Sizes& sizes) {
    ping_.filler().resize(sizes.request - bench::kPingOverhead);
    ping_.reply_bytes(sizes.reply);
  }

  void call() {
    ping_.sequence_number(ping_.sequence_number() + 1);
    endpoints_.write(ping_);
    std::unique_lock lock(mutex_);
    // Repeats the request, as tf-dude does.
    while (!arrived_.wait_for(lock, std::chrono::milliseconds(2),
                              [this] { return answered_ == ping_.sequence_number(); })) {
      endpoints_.write(ping_);
    }
  }

  void on_data_available(edds::DataReader* reader) override {
    if (!tfdude::fastdds::ok(reader->take_next_sample(&pong_, &info_)) || !info_.valid_data) return;
    {
      const std::lock_guard lock(mutex_);
      answered_ = pong_.sequence_number();
    }
    arrived_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::uint32_t answered_ = 0;
  bench::wire::Ping ping_;
  bench::wire::Ping pong_;
  edds::SampleInfo info_;
  bench::FloorEndpoints endpoints_;
};

class UdpPing {
 public:
  explicit UdpPing(int port) : port_(static_cast<std::uint16_t>(port)) {}

  void call(const Sizes& sizes) {
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
  DdsPing dds(static_cast<std::uint32_t>(arguments.number("domain")), arguments.text("profile"));
  UdpPing udp(arguments.number("udp-port"));

  const auto compare = [&](const std::string& what, const Sizes& sizes, auto ours) {
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
          sizes_of({1, kFrame, tfdude::UpdateRequest{{{kFrame, X}}}}, {1, 0, tfdude::Done{}}),
          [&] { bench::check(client.update(kFrame, X), "update"); });
  compare("lookup",
          sizes_of({1, kFrame, tfdude::LookupRequest{{{kFrom, kFrame}}}},
                   {1, 0, tfdude::SegmentValues{{X}, {}, {}, {}}}),
          [&] { bench::check(client.lookup(kFrom, kFrame), "lookup"); });
  return 0;
}
