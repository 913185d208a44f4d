// All replicas become equal after any concurrent changes of owners, and any deaths and returns.

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/owning.hpp"
#include "support/random.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::any_change;
using testing::lines_diff;
using testing::MemoryStore;
using testing::Owning;
using testing::presence_of;
using testing::Random;
using testing::Replica;
using Said = std::variant<Presence, Page>;

constexpr std::size_t kOwners = 4;
constexpr std::size_t kSpectator = kOwners;
constexpr std::size_t kFrames = 12;  // few, so that owners often compete for them

// Owners that make any change that their own replica allows, hear of each other late, and are
// killed and restarted from their stored state; and one participant that only listens.
class World {
 public:
  explicit World(Random& random) : random_(random) {
    for (std::size_t who = 0; who < kOwners; ++who) start(who);
  }

  void step() {
    const std::size_t what = random_.index(20);
    const std::size_t who = random_.index(kOwners);
    if (what < 11) {
      deliver_one();
    } else if (what < 18) {
      if (owners_[who]) change(who);
    } else if (owners_[who] && what == 18) {
      kill(who);
    } else if (!owners_[who]) {
      start(who);
    }
  }

  void run_until_quiet() {
    for (std::size_t who = 0; who < kOwners; ++who) {
      if (!owners_[who]) start(who);
    }
    while (!queues_.empty()) deliver_one();
  }

  [[nodiscard]] std::vector<std::string> structure(std::size_t who) const {
    return (who == kSpectator ? spectator_ : owners_[who]->replica).structure();
  }
  [[nodiscard]] std::size_t conflicts() const { return conflicts_; }
  [[nodiscard]] std::size_t orphans() const { return orphans_; }

 private:
  static std::string name(std::size_t who) { return "p" + std::to_string(who); }

  // Clocks that are up to a second apart. Events are a millisecond apart.
  Time now(std::size_t who) { return Time(std::chrono::milliseconds(++clock_ + 300 * who)); }

  void start(std::size_t who) {
    auto owner = std::make_unique<Owning>(name(who), ++lives_);
    for (const auto& other : owners_) {
      if (!other || random_.index(4) == 0) continue;  // some are discovered only later
      owner->replica.directory.apply(other->presence, now(who));
      for (const auto& [number, page] : other->published) owner->replica.directory.apply(page);
    }
    const auto state = stores_[who].load();
    REQUIRE(owner->partition.restore(*state, {}, now(who)));
    owner->presence = presence_of(name(who), lives_, 0);
    owners_[who] = std::move(owner);
    for (std::size_t other = 0; other < kOwners; ++other) {
      if (other == who || !owners_[other]) continue;
      // What it did not receive at the start arrives as all other messages do.
      say({other, who}, owners_[other]->presence);
      for (const auto& [number, page] : owners_[other]->published) say({other, who}, page);
    }
    publish(who);
  }

  void kill(std::size_t who) {
    owners_[who].reset();
    for (auto queue = queues_.begin(); queue != queues_.end();) {
      const bool concerned = queue->first.first == who || queue->first.second == who;
      queue = concerned ? queues_.erase(queue) : std::next(queue);
    }
  }

  void publish(std::size_t who) {
    Owning& owner = *owners_[who];
    for (const Change& one : owner.replica.directory.changes().take()) {
      conflicts_ += one.kind == ChangeKind::kConflict ? 1 : 0;
    }
    REQUIRE(stores_[who].save(testing::unsaved(owner.partition)));
    const auto pages = owner.partition.take_pages();
    for (const Page& page : pages) owner.published[page.number] = page;
    owner.presence.pages = owner.partition.page_count();
    for (std::size_t hearer = 0; hearer <= kOwners; ++hearer) {
      if (hearer == who || (hearer < kOwners && !owners_[hearer])) continue;
      for (const Page& page : pages) say({who, hearer}, page);
      say({who, hearer}, owner.presence);
    }
  }

  void say(const std::pair<std::size_t, std::size_t>& way, const Said& said) {
    queues_[way].push_back(said);
  }

  void change(std::size_t who) {
    Owning& owner = *owners_[who];
    const Request request = any_change(random_, owner.replica.forest, kFrames);
    (void)owner.partition.answer(request, now(who));
    publish(who);
  }

  void deliver_one() {
    if (queues_.empty()) return;
    auto queue = std::next(queues_.begin(), static_cast<int>(random_.index(queues_.size())));
    const std::size_t hearer = queue->first.second;
    const Said said = std::move(queue->second.front());
    queue->second.pop_front();
    const auto* page = std::get_if<Page>(&said);
    const bool again = std::any_of(queue->second.begin(), queue->second.end(), [&](const Said& s) {
      const auto* later = std::get_if<Page>(&s);
      return page != nullptr && later != nullptr && later->number == page->number &&
             later->incarnation == page->incarnation;
    });
    if (queue->second.empty()) queues_.erase(queue);
    if (again && random_.index(2) == 0) return;
    Replica& replica = hearer == kSpectator ? spectator_ : owners_[hearer]->replica;
    if (page != nullptr) {
      replica.directory.apply(*page);
    } else {
      replica.directory.apply(std::get<Presence>(said), now(0));
    }
    if (hearer == kSpectator) return;
    const std::size_t before = owners_[hearer]->partition.frame_count();
    bool yielded = false;
    Partition& partition = owners_[hearer]->partition;
    while (partition.yield(partition.pending_yields(), now(hearer))) yielded = true;
    if (!yielded) return;
    if (owners_[hearer]->partition.frame_count() < before) ++orphans_;
    publish(hearer);
  }

  Random& random_;
  std::array<std::unique_ptr<Owning>, kOwners> owners_;
  std::array<MemoryStore, kOwners> stores_;
  Replica spectator_;
  std::map<std::pair<std::size_t, std::size_t>, std::deque<Said>> queues_;  // by owner and hearer
  std::uint64_t lives_ = 0;
  std::size_t clock_ = 0;
  std::size_t conflicts_ = 0;
  std::size_t orphans_ = 0;
};

TEST_CASE("all replicas become equal after any history of changes and deaths and returns") {
  Random random(0xc0f1);
  INFO("seed " << random.seed());
  std::size_t conflicts = 0;
  std::size_t orphans = 0;
  for (int round = 0; round < 200; ++round) {
    World world(random);
    for (int step = 0; step < 300; ++step) world.step();
    world.run_until_quiet();
    conflicts += world.conflicts();
    orphans += world.orphans();
    INFO("round " << round);
    for (std::size_t who = 0; who < kOwners; ++who) {
      INFO("owner " << who << " and the spectator");
      REQUIRE(lines_diff(world.structure(who), world.structure(kSpectator)) == "");
    }
  }
  // Otherwise the test has shown nothing.
  CHECK(conflicts > 100);
  CHECK(orphans > 100);
}

}  // namespace
}  // namespace tfdude
