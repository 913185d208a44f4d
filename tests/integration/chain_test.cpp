// Five daemons whose partitions hang below each other, as a chain and as a star.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/agreement.hpp"
#include "support/catch.hpp"
#include "support/test_domain.hpp"
#include "support/topology.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::lookups_diff;
using testing::Oracle;
using testing::PartitionSpec;
using testing::Process;
using testing::Random;
using testing::structure_diff;

/// Five partitions: one in the test's process, the others in daemons, and a client that owns none.
struct Five {
  Five(Random& random, bool star, std::size_t here) {
    const auto partitions = testing::five_partitions(random, star);
    std::vector<Process> starting;
    for (std::size_t i = 0; i < partitions.size(); ++i) {
      const PartitionSpec& partition = partitions[i];
      for (const FrameSpec& frame : partition.frames) {
        oracle.add(frame.id, frame.parent, frame.X_PC);
        owners[frame.id] = partition.name;
      }
      if (i == here) continue;
      const auto config = directory.write(partition.name + ".yaml", partition.yaml());
      daemons.push_back(domain.start_daemon({"--config", config}));
    }
    node.emplace(
        Node::open(partitions[here].name, partitions[here].frames, domain.options()).value());
    for (Process& daemon : daemons) testing::await_ready(daemon);
    client.emplace(Client::open(domain.options()).value());
    await_agreement();
  }

  std::vector<Client*> callers() { return {&*node, &*client}; }

  void await_agreement() {
    for (Client* caller : callers()) {
      REQUIRE(eventually([&] { return structure_diff(*caller, oracle).empty(); }));
    }
  }

  void check_all() {
    for (Client* caller : callers()) {
      CHECK(structure_diff(*caller, oracle) == "");
      CHECK(lookups_diff(*caller, oracle) == "");
      const auto frames = caller->frames().value();
      for (const Frame& frame : frames) CHECK(frame.partition == owners.at(frame.id));
    }
  }

  testing::TestDomain domain;
  testing::TemporaryDirectory directory;
  std::vector<Process> daemons;
  std::optional<Node> node;
  std::optional<Client> client;
  Oracle oracle;
  std::map<std::string, std::string> owners;  // partition of each frame
};

/// One random change by one caller, of any partition's frames, which the oracle makes too.
void change_something(Five& five, Random& random, int number) {
  Client& caller = *five.callers()[random.index(2)];
  const auto ids = five.oracle.ids();
  const auto any = [&] { return ids[random.index(ids.size())]; };
  const Transform X = random.transform();
  const std::string id = any();
  const std::string other = any();
  const bool is_root = five.oracle.parent(id).empty();
  switch (random.index(5)) {
    case 0: {
      const std::string added = "new_" + std::to_string(number);
      // Below its parent's owner's other frames, or an edge between two partitions.
      const std::string partition = random.index(2) == 0 ? "" : five.owners.at(other);
      REQUIRE(caller.add(added, id, X, partition));
      five.oracle.add(added, id, X);
      five.owners[added] = partition.empty() ? five.owners.at(id) : partition;
      break;
    }
    case 1:
      if (is_root) break;
      REQUIRE(caller.update(id, X));
      five.oracle.update(id, X);
      break;
    case 2:
      if (five.oracle.is_below(other, id)) {
        CHECK(caller.move(id, other).error().code == Errc::kCycle);
      } else {
        REQUIRE(caller.move(id, other));
        five.oracle.move(id, other);
      }
      break;
    case 3:
      // Leaves only, so that something stays to be changed.
      for (const std::string& frame : ids) {
        if (frame != id && five.oracle.is_below(frame, id)) return;
      }
      REQUIRE(caller.remove(id));
      five.oracle.remove(id);
      break;
    default: {
      std::vector<EdgeUpdate> edges;
      for (const std::string& frame : ids) {
        if (!five.oracle.parent(frame).empty()) edges.push_back({frame, random.transform()});
      }
      REQUIRE(caller.update(edges));
      for (const EdgeUpdate& edge : edges) five.oracle.update(edge.id, edge.X_PC);
      break;
    }
  }
}

}  // namespace

TEST_CASE("five: every pair of frames is looked up in a chain and in a star of partitions") {
  const bool star = GENERATE(false, true);
  const int here = GENERATE(0, 2, 4);
  Random random(20261121);
  INFO("seed " << random.seed() << (star ? ", star, partition " : ", chain, partition ") << here);
  Five five(random, star, static_cast<std::size_t>(here));
  five.check_all();
}

TEST_CASE("five: a path through all partitions of a chain names each once") {
  Random random(7);
  INFO("seed " << random.seed());
  Five five(random, false, 1);
  for (Client* caller : five.callers()) {
    const auto path = caller->path("p0_a", "p4_a");
    REQUIRE(path);
    REQUIRE(path->size() >= 4);  // the first only where its root is not the place of connection
    for (std::size_t i = 0; i < path->size(); ++i) {
      CHECK((*path)[i].partition == "p" + std::to_string(i + 5 - path->size()));
    }
  }
}

TEST_CASE("five: all participants agree after random changes from two processes") {
  const bool star = GENERATE(false, true);
  Random random(star ? 4711 : 815);
  INFO("seed " << random.seed() << (star ? ", star" : ", chain"));
  Five five(random, star, star ? 0 : 2);
  for (int i = 0; i < 100; ++i) {
    change_something(five, random, i);
    five.await_agreement();
  }
  five.check_all();
}

TEST_CASE("five: a removal in the middle empties partitions below and they can be attached again") {
  const bool star = GENERATE(false, true);
  Random random(99);
  INFO("seed " << random.seed() << (star ? ", star" : ", chain"));
  Five five(random, star, star ? 0 : 2);
  const auto removed = star ? "p3_a" : "p1_a";
  REQUIRE(five.client->remove(removed));
  five.oracle.remove(removed);
  five.await_agreement();
  five.check_all();
  CHECK(five.client->partitions().value().size() == 5);
  const auto partitions = five.client->partitions().value();
  for (const PartitionInfo& partition : partitions) CHECK(partition.reachable);
  for (Process& daemon : five.daemons) CHECK(daemon.runs());
  // In the other order this time.
  std::string parent = "p0_a";
  for (const char* partition : {"p4", "p3", "p2", "p1"}) {
    const std::string id = std::string(partition) + "_again";
    const Transform X = random.transform();
    REQUIRE(five.client->add(id, parent, X, partition));
    five.oracle.add(id, parent, X);
    five.owners[id] = partition;
    parent = id;
  }
  five.await_agreement();
  five.check_all();
}

}  // namespace tfdude
