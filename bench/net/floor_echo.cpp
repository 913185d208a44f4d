// The other end of floor_bench and of scale_bench's fan-out: bare echoes over UDP and Fast DDS.
// Prints "ready udp_port=PORT" and answers until it is stopped.
//
//   floor_echo --domain DOMAIN --profile FILE --partition NAME
//
// The DDS partition of requests (empty: the default one); it answers in the default one.

#include <cstdio>
#include <string>

#include "net/floor_dds.hpp"
#include "net/harness.hpp"
#include "net/udp.hpp"

namespace {

namespace edds = tfdude::fastdds::edds;

/// Answers in the callback, with a writer that already exists.
class DdsEcho final : public edds::DataReaderListener {
 public:
  explicit DdsEcho(const bench::Arguments& arguments)
      : endpoints_(static_cast<std::uint32_t>(arguments.number("domain")),
                   arguments.text("profile"), ends(arguments.text("partition")), *this) {}

  void on_data_available(edds::DataReader* reader) override {
    if (!tfdude::fastdds::ok(reader->take_next_sample(&sample_, &info_)) || !info_.valid_data)
      return;
    sample_.filler().resize(sample_.reply_bytes() - bench::kPingOverhead);
    endpoints_.write(sample_);
  }

 private:
  static bench::FloorEnds ends(const std::string& partition) {
    auto ends = bench::answering_end();
    ends.read = partition;
    return ends;
  }

  bench::wire::Ping sample_;
  edds::SampleInfo info_;
  bench::FloorEndpoints endpoints_;
};

}  // namespace

int main(int argc, char** argv) {
  const DdsEcho dds(bench::Arguments(argc, argv));
  bench::UdpSocket udp;
  std::printf("ready udp_port=%d\n", udp.port());
  std::fflush(stdout);
  udp.echo();
}
