// A request wakes only its owner. Counts requests below the readers, before the filters.

#include <memory>
#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "support/catch.hpp"
#include "support/domain_lease.hpp"

namespace tfdude {
namespace {

struct Counted {
  Counted(std::uint32_t domain, const std::string& partition, const std::string& frame)
      : node(Node::open(
                 *make_fastdds_transport({domain, TFDUDE_LOOPBACK_PROFILE, partition, counters}),
                 partition, {{frame, "", {}}})
                 .value()) {}

  std::shared_ptr<FastDdsCounters> counters = std::make_shared<FastDdsCounters>();
  Node node;
};

}  // namespace

TEST_CASE("a participant that does not own the frame receives no request") {
  const testing::DomainLease lease;
  const std::uint32_t domain = lease.number();
  Counted owner(domain, "owner", "a");
  Counted other(domain, "other", "b");
  auto client =
      Client::open(*make_fastdds_transport({domain, TFDUDE_LOOPBACK_PROFILE, "", nullptr})).value();
  constexpr std::uint64_t kCalls = 100;
  for (std::uint64_t i = 0; i < kCalls; ++i) {
    REQUIRE(client.update("a", {}));
    REQUIRE(other.node.update("a", {}));
  }
  CHECK(owner.counters->requests_arrived >= 2 * kCalls);
  CHECK(owner.counters->requests_passed == owner.counters->requests_arrived);
  CHECK(other.counters->requests_arrived == 0);
  CHECK(other.counters->updates_arrived == 0);
}

}  // namespace tfdude
