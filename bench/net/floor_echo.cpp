// The other end of floor_bench and of scale_bench's fan-out: bare echoes over UDP and, if a domain
// is given, over Fast DDS. Prints "ready udp_port=PORT" and answers until it is stopped.
//
//   floor_echo --domain DOMAIN --profile FILE
//   floor_echo

#include <cstdio>
#include <optional>

#include "net/floor_dds.hpp"
#include "net/harness.hpp"
#include "net/udp.hpp"

namespace {

namespace edds = tfdude::fastdds::edds;

/// Answers in the callback, with a writer that already exists.
class DdsEcho final : public edds::DataReaderListener {
 public:
  DdsEcho(std::uint32_t domain, const std::string& profile)
      : endpoints_(domain, profile, bench::kPongTopic, bench::kPingTopic, *this, "call") {}

  void on_data_available(edds::DataReader* reader) override {
    if (!tfdude::fastdds::ok(reader->take_next_sample(&sample_, &info_)) || !info_.valid_data)
      return;
    sample_.filler().resize(sample_.reply_bytes() - bench::kPingOverhead);
    endpoints_.write(sample_);
  }

 private:
  bench::wire::Ping sample_;
  edds::SampleInfo info_;
  bench::FloorEndpoints endpoints_;
};

}  // namespace

int main(int argc, char** argv) {
  std::optional<DdsEcho> dds;
  if (argc > 1) {
    const bench::Arguments arguments(argc, argv);
    dds.emplace(static_cast<std::uint32_t>(arguments.number("domain")), arguments.text("profile"));
  }
  bench::UdpSocket udp;
  std::printf("ready udp_port=%d\n", udp.port());
  std::fflush(stdout);
  udp.echo();
}
