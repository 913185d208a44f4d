// A replica is a function of the messages, not of the order of their arrival.

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::lines_diff;
using testing::presence_of;
using testing::Random;
using testing::Replica;
using Said = std::variant<Presence, Page>;

constexpr Time kNow{std::chrono::seconds(100)};
constexpr std::size_t kFrames = 24;

std::string frame(std::size_t number) { return "f" + std::to_string(number); }

// The messages of one process of a partition: pages with frames of the common pool, and a presence.
// In a first process any frame may be the parent, so that processes contradict each other. In the
// last one parents have lower numbers, so that the result has no cycle.
void live(Random& random, const std::string& partition, std::uint64_t incarnation, bool last,
          std::vector<Said>& said) {
  std::vector<Page> pages(1 + random.index(4));
  for (std::uint32_t i = 0; i < pages.size(); ++i) pages[i] = {partition, i, incarnation, i, {}};
  for (std::size_t number = 0; number < kFrames; ++number) {
    if (random.index(3) == 0) continue;
    const std::size_t parent = random.index(last ? number + 1 : kFrames);
    pages[random.index(pages.size())].entries.push_back(
        {frame(number), parent == number ? "" : frame(parent)});
  }
  said.emplace_back(presence_of(partition, incarnation, static_cast<std::uint32_t>(pages.size())));
  said.insert(said.end(), pages.begin(), pages.end());
}

std::vector<Said> lives_of_several(Random& random) {
  std::vector<Said> said;
  for (const char* partition : {"arms", "chest", "legs", "wings"}) {
    const std::size_t lives = 1 + random.index(3);
    for (std::size_t i = 1; i <= lives; ++i) live(random, partition, i, i == lives, said);
  }
  return said;
}

struct Hearer : Replica {
  // Owns some frames of the pool itself, if it has a name.
  explicit Hearer(const std::string& own) : Replica(own) {
    for (std::size_t i = 0; i < (own.empty() ? 0 : kFrames); i += 5) {
      REQUIRE(forest.add(frame(i), i == 0 ? "" : frame(i - 1), along_x(1),
                         Forest::MissingParent::kAllow));
    }
  }

  void hear(const std::vector<Said>& all) {
    for (const Said& one : all) {
      if (const auto* page = std::get_if<Page>(&one)) {
        directory.apply(*page);
      } else {
        directory.apply(std::get<Presence>(one), kNow);
      }
    }
  }

  [[nodiscard]] std::vector<std::string> all() const {
    std::vector<std::string> lines = structure();
    for (const PartitionInfo& info : directory.partitions()) {
      const Owner owner = *directory.owner(info.name);
      lines.push_back(info.name + " of " + info.host + ", frames " + std::to_string(info.frames) +
                      ", epoch " + std::to_string(directory.epoch(owner)) +
                      (info.reachable ? "" : ", unreachable"));
    }
    lines.emplace_back(directory.complete() ? "complete" : "incomplete");
    std::sort(lines.begin(), lines.end());
    return lines;
  }

  void release_all() {
    for (const FrameInfo& info : forest.frames()) {
      if (info.owner != kHeldHere) continue;
      const auto removed = forest.remove(info.id);
      if (!removed) continue;  // already removed with a frame above it
      for (const std::string& id : *removed) directory.released(id);
    }
  }
};

TEST_CASE("a directory does not depend on the order of messages") {
  const std::string own = GENERATE(as<std::string>{}, "", "bench");
  Random random(0xd12ec7);
  INFO("seed " << random.seed());
  for (int round = 0; round < 60; ++round) {
    std::vector<Said> said = lives_of_several(random);
    Hearer first(own);
    first.hear(said);
    Hearer releasing(own);
    releasing.hear(said);
    releasing.release_all();
    REQUIRE(first.directory.complete());
    for (int order = 0; order < 20; ++order) {
      for (std::size_t copies = random.index(4); copies > 0; --copies) {
        said.push_back(said[random.index(said.size())]);
      }
      std::shuffle(said.begin(), said.end(), random.engine());
      Hearer other(own);
      other.hear(said);
      INFO("round " << round << ", order " << order);
      REQUIRE(lines_diff(other.all(), first.all()) == "");
      other.release_all();
      REQUIRE(lines_diff(other.all(), releasing.all()) == "");
    }
  }
}

// Owners change their structure at random. Each message is delayed by a random time, and a page may
// be replaced by a later one of the same number.
class World {
 public:
  explicit World(Random& random) : random_(random) {
    for (const char* name : {"arms", "chest", "legs"}) {
      auto owner = std::make_unique<Owning>(name);
      owners_.push_back(std::move(owner));
    }
  }

  void step() {
    if (random_.index(3) > 0) {
      deliver_one();
      return;
    }
    const std::size_t who = random_.index(owners_.size());
    for (std::size_t changes = 1 + random_.index(2); changes > 0; --changes) change(who);
    for (const Page& page : owners_[who]->partition.take_pages()) {
      for (std::size_t hearer = 0; hearer <= owners_.size(); ++hearer) {
        if (hearer != who) queues_[{who, hearer}].push_back(page);
      }
    }
  }

  void deliver_all() {
    while (!queues_.empty()) deliver_one();
  }

  [[nodiscard]] std::vector<std::string> truth() const {
    std::vector<std::string> lines;
    for (const auto& [id, place] : truth_) {
      const bool attached = truth_.count(place.parent) != 0;
      lines.push_back(id + " < " + place.parent + " @ " + owners_[place.owner]->partition.name() +
                      (attached ? ", attached" : ""));
    }
    std::sort(lines.begin(), lines.end());
    return lines;
  }

  [[nodiscard]] std::vector<const Replica*> replicas() const {
    std::vector<const Replica*> all{&spectator_};
    for (const auto& owner : owners_) all.push_back(&owner->replica);
    return all;
  }

 private:
  struct Owning {
    explicit Owning(const std::string& name)
        : replica(name), partition(name, 1, replica.forest, replica.directory) {}
    Replica replica;
    Partition partition;
  };
  struct Place {
    std::size_t owner;
    std::string parent;
  };

  // Only changes that form no cycle in truth: cycles of concurrent changes have their own test.
  void change(std::size_t who) {
    const std::string id = frame(random_.index(kFrames));
    const std::string parent = random_.index(5) == 0 ? "" : frame(random_.index(kFrames));
    const auto there = truth_.find(id);
    Request request{0, id, {}};
    if (there == truth_.end()) {
      request.body = AddRequest{parent, along_x(1)};
    } else if (there->second.owner != who) {
      return;
    } else if (random_.index(3) == 0) {
      request.body = RemoveRequest{{id}};
    } else {
      request.body = MoveRequest{parent, {}};
    }
    const bool removal = std::holds_alternative<RemoveRequest>(request.body);
    if (!removal && below(parent, id)) return;
    const Reply reply = owners_[who]->partition.answer(request, kNow);
    if (!std::holds_alternative<Done>(reply.body)) return;  // its replica is behind the truth
    if (removal) {
      forget(who, id);
    } else {
      truth_[id] = {who, parent};
    }
  }

  [[nodiscard]] bool below(std::string id, const std::string& top) const {
    while (id != top) {
      const auto there = truth_.find(id);
      if (there == truth_.end()) return false;
      id = there->second.parent;
    }
    return true;
  }

  void forget(std::size_t who, const std::string& id) {
    truth_.erase(id);
    std::set<std::string> children;
    for (const auto& [child, place] : truth_) {
      if (place.owner == who && place.parent == id) children.insert(child);
    }
    for (const std::string& child : children) forget(who, child);
  }

  void deliver_one() {
    if (queues_.empty()) return;
    auto queue = std::next(queues_.begin(), static_cast<int>(random_.index(queues_.size())));
    std::deque<Page>& pages = queue->second;
    const Page page = std::move(pages.front());
    pages.pop_front();
    const bool again = std::any_of(pages.begin(), pages.end(),
                                   [&](const Page& later) { return later.number == page.number; });
    const std::size_t hearer = queue->first.second;
    if (pages.empty()) queues_.erase(queue);
    if (again && random_.index(2) == 0) return;
    Replica& replica = hearer == owners_.size() ? spectator_ : owners_[hearer]->replica;
    replica.directory.apply(page);
  }

  Random& random_;
  std::vector<std::unique_ptr<Owning>> owners_;
  Replica spectator_;
  std::map<std::string, Place> truth_;
  std::map<std::pair<std::size_t, std::size_t>, std::deque<Page>> queues_;  // by owner and hearer
};

TEST_CASE("all replicas converge to the structure of the owners") {
  Random random(0x0a11);
  INFO("seed " << random.seed());
  for (int round = 0; round < 30; ++round) {
    World world(random);
    for (int step = 0; step < 400; ++step) world.step();
    world.deliver_all();
    INFO("round " << round);
    for (const Replica* replica : world.replicas()) {
      INFO("replica of '" << replica->directory.name(kHeldHere) << "'");
      REQUIRE(lines_diff(replica->structure(), world.truth()) == "");
    }
  }
}

}  // namespace
}  // namespace tfdude
