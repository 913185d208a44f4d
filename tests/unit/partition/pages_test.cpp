#include "partition/pages.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::lines_diff;
using testing::Random;
using testing::Replica;
using Structure = std::map<std::string, std::string>;  // id to parent
using Numbers = std::vector<std::uint32_t>;

constexpr std::uint64_t kLife = 7;  // the incarnation, from which epochs count

Numbers numbers_of(const std::vector<Page>& pages) {
  Numbers numbers;
  for (const Page& page : pages) numbers.push_back(page.number);
  return numbers;
}

Structure structure_of(const std::vector<Page>& pages) {
  Structure structure;
  for (const Page& page : pages) {
    for (const PageEntry& entry : page.entries) structure[entry.id] = entry.parent;
  }
  return structure;
}

std::vector<std::string> others_of(const Page& page) {
  std::vector<std::string> others;
  for (const PageEpoch& one : page.others) {
    others.push_back(std::to_string(one.number) + ": " + std::to_string(one.epoch));
  }
  return others;
}

void put_numbered(Pages& pages, std::size_t first, std::size_t count) {
  for (std::size_t i = first; i < first + count; ++i) pages.put("f" + std::to_string(i), "", 0);
}

TEST_CASE("a new structure has no pages and nothing to publish") {
  Pages pages("robot", kLife);
  CHECK(pages.count() == 0);
  CHECK(pages.frame_count() == 0);
  CHECK(pages.epoch() == kLife);
  CHECK(pages.take_changed().empty());
}

TEST_CASE("a page has its partition and incarnation and entries") {
  Pages pages("robot", kLife);
  pages.put("world", "", 0);
  pages.put("base", "world", 0);
  CHECK(pages.close_epoch() == kLife + 1);
  const auto changed = pages.take_changed();
  REQUIRE(changed.size() == 1);
  CHECK(changed[0].partition == "robot");
  CHECK(changed[0].incarnation == kLife);
  CHECK(changed[0].number == 0);
  CHECK(changed[0].epoch == kLife + 1);
  CHECK(structure_of(changed) == Structure{{"base", "world"}, {"world", ""}});
}

// So many frames fill the first pages.
constexpr std::size_t kFirst = Pages::room_of(0);

TEST_CASE("a full page is followed by another, and later pages have more room") {
  Pages pages("robot", kLife);
  put_numbered(pages, 0, kFirst);
  CHECK(pages.count() == 1);
  put_numbered(pages, kFirst, 1);
  CHECK(pages.count() == 2);
  put_numbered(pages, kFirst + 1, 20'000);
  const auto changed = pages.take_changed();
  REQUIRE(changed.size() > 333);
  CHECK(changed.size() < 400);
  CHECK(changed[0].entries.size() == 8);
  CHECK(changed[1].entries.size() == 9);
  CHECK(changed[51].entries.size() == 59);
  CHECK(changed[52].entries.size() == Pages::kPageSize);
  CHECK(changed[changed.size() - 2].entries.size() == Pages::kPageSize);
}

TEST_CASE("only pages that changed since the last time are published") {
  Pages pages("robot", kLife);
  put_numbered(pages, 0, 3 * kFirst);
  CHECK(numbers_of(pages.take_changed()) == Numbers{0, 1, 2});
  CHECK(pages.take_changed().empty());
  pages.put("f" + std::to_string(kFirst), "f0", 0);
  CHECK(numbers_of(pages.take_changed()) == Numbers{1});
  pages.erase("f0");
  pages.erase("f" + std::to_string(3 * kFirst - 1));
  CHECK(numbers_of(pages.take_changed()) == Numbers{0, 2});
  pages.erase("nobody");
  CHECK(pages.take_changed().empty());
}

TEST_CASE("what comes instead of something else is on its page") {
  Pages pages("robot", kLife);
  put_numbered(pages, 0, 3 * kFirst);
  pages.erase("f0");
  CHECK(numbers_of(pages.take_changed()).size() == 3);
  // Page 0 has room, but page 2 is published in any case.
  const std::string last = "f" + std::to_string(3 * kFirst - 1);
  pages.erase(last);
  pages.leave({last, 1, Tombstone::Kind::kRemoved, {}});
  CHECK(numbers_of(pages.take_changed()) == Numbers{2});
  pages.put(last, "", 2);
  CHECK(numbers_of(pages.take_changed()) == Numbers{2});
  put_numbered(pages, 1000, 1);
  CHECK(numbers_of(pages.take_changed()) == Numbers{0});
}

TEST_CASE("room on a page is reused even after the page was empty") {
  Pages pages("robot", kLife);
  put_numbered(pages, 0, kFirst + Pages::room_of(1));
  (void)pages.take_changed();
  for (std::size_t i = 0; i < kFirst; ++i) pages.erase("f" + std::to_string(i));
  CHECK(pages.frame_count() == Pages::room_of(1));
  const auto emptied = pages.take_changed();
  CHECK(numbers_of(emptied) == Numbers{0});
  CHECK(emptied[0].entries.empty());
  put_numbered(pages, 1000, kFirst);
  CHECK(pages.count() == 2);
  CHECK(numbers_of(pages.take_changed()) == Numbers{0});
  pages.put("one more", "", 0);
  CHECK(pages.count() == 3);
}

TEST_CASE("the last page of a publication lists the pages that changed before it or with it") {
  Pages pages("robot", kLife);
  put_numbered(pages, 0, 3 * kFirst);
  CHECK(pages.close_epoch() == kLife + 1);
  auto changed = pages.take_changed();
  REQUIRE(changed.size() == 3);
  CHECK(others_of(changed[0]) == std::vector<std::string>{"2: 8"});
  CHECK(others_of(changed[1]) == std::vector<std::string>{"2: 8"});
  CHECK(others_of(changed[2]) == std::vector<std::string>{"1: 8", "0: 8"});
  pages.put("f0", "f1", 0);
  CHECK(pages.close_epoch() == kLife + 2);
  pages.put("f" + std::to_string(kFirst), "f1", 0);
  CHECK(pages.close_epoch() == kLife + 3);
  changed = pages.take_changed();
  REQUIRE(changed.size() == 2);
  CHECK(changed[0].epoch == kLife + 3);
  CHECK(changed[1].epoch == kLife + 3);
  CHECK(others_of(changed[0]) == std::vector<std::string>{"1: 10"});
  // Page 2 did not change since all pages were published.
  CHECK(others_of(changed[1]) == std::vector<std::string>{"0: 10"});
  pages.put("f0", "", 0);
  CHECK(pages.close_epoch() == kLife + 4);
  changed = pages.take_changed();
  REQUIRE(changed.size() == 1);
  CHECK(others_of(changed[0]) == std::vector<std::string>{"1: 10"});
}

TEST_CASE("a page lists a limited number of pages that changed with it") {
  Pages pages("robot", kLife);
  put_numbered(pages, 0, 60 * kFirst);
  const auto changed = pages.take_changed();
  REQUIRE(changed.size() > Pages::kOthers + 1);
  CHECK(changed.front().others.size() == 1);
  CHECK(changed.back().others.size() == Pages::kOthers);
}

// Pages in transit. A later page may replace an earlier one of the same number.
class Way {
 public:
  void put(const Page& page) { pages_.push_back(page); }

  void deliver(Random& random, Replica& replica) {
    for (std::size_t some = random.index(4); some > 0 && !pages_.empty(); --some) {
      const Page page = std::move(pages_.front());
      pages_.pop_front();
      const bool again = std::any_of(pages_.begin(), pages_.end(), [&](const Page& later) {
        return later.number == page.number;
      });
      if (!again || random.index(2) == 0) replica.directory.apply(page);
    }
  }

 private:
  std::deque<Page> pages_;
};

TEST_CASE("a page that does not change is published again from time to time") {
  Pages pages("robot", kLife);
  for (int i = 0; i < 30; ++i) pages.put("f" + std::to_string(i), "", 1);
  (void)pages.take_changed();
  REQUIRE(pages.count() >= 3);
  std::map<std::uint32_t, std::uint64_t> published;  // the number of the last publication
  std::uint64_t number = 0;
  std::uint64_t longest = 0;
  for (int change = 0; change < 20'000; ++change) {
    pages.put("f29", "", 2);
    pages.close_epoch();
    for (const Page& page : pages.take_changed()) published[page.number] = ++number;
    for (std::uint32_t page = 0; page < pages.count(); ++page) {
      longest = std::max(longest, number - published[page]);
    }
  }
  CHECK(longest <= Pages::kRepeatWithin + pages.count());
  CHECK(static_cast<double>(number) <= 20'000 * (1 + 2.0 * pages.count() / Pages::kRepeatWithin));
}

TEST_CASE("the pages of a large partition stay within what a heartbeat may span") {
  constexpr std::uint32_t kLongestSpan = 65'536;  // fastdds::kLongestRange
  Pages pages("robot", kLife);
  int frames = 0;
  while (pages.count() < 10'000) pages.put("f" + std::to_string(frames++), "", 1);
  std::vector<std::uint32_t> published(pages.count());  // the number of the last publication
  std::uint32_t number = 0;
  std::uint32_t longest = 0;
  const auto publish = [&] {
    for (const Page& page : pages.take_changed()) {
      longest = std::max(longest, number - published[page.number]);
      published[page.number] = ++number;
    }
  };
  publish();
  for (int change = 0; change < 90'000; ++change) {
    pages.put("f0", "", 2);
    pages.close_epoch();
    publish();
  }
  CHECK(longest < kLongestSpan);
  CHECK(number - *std::min_element(published.begin(), published.end()) < kLongestSpan);
}

TEST_CASE("a replica that receives the pages in order has the owner's structure") {
  Random random(0x9a6e5);
  INFO("seed " << random.seed());
  Pages pages("robot", kLife);
  Structure owned;
  Replica replica;
  Replica late;
  Way way;
  std::uint64_t stamp = 0;
  int late_has_all = 0;
  constexpr int kSteps = 3000;
  for (int step = 0; step < kSteps; ++step) {
    // Several changes at a time, some of the same frame, which may change its page in between.
    std::string id = "f" + std::to_string(random.index(300));
    for (std::size_t changes = 1 + random.index(3); changes > 0; --changes) {
      if (random.index(3) > 0) id = "f" + std::to_string(random.index(300));
      if (random.index(5) < 3) {
        const std::string parent = "p" + std::to_string(random.index(10));
        pages.put(id, parent, ++stamp);
        owned[id] = parent;
      } else {
        pages.erase(id);
        owned.erase(id);
      }
      pages.close_epoch();
    }
    for (const Page& page : pages.take_changed()) {
      REQUIRE(page.entries.size() <= Pages::kPageSize);
      replica.directory.apply(page);
      way.put(page);
    }
    way.deliver(random, late);
    std::vector<std::string> expected;
    for (const auto& [owned_id, parent] : owned)
      expected.push_back(owned_id + " < " + parent + " @ robot");
    INFO("step " << step);
    REQUIRE(lines_diff(replica.structure(), expected) == "");
    REQUIRE(pages.frame_count() == owned.size());
    const auto known = late.directory.owner("robot");
    if (!known || late.directory.epoch(*known) < pages.epoch()) continue;
    ++late_has_all;
    REQUIRE(lines_diff(late.structure(), expected) == "");
  }
  CHECK(late_has_all > 100);
  const Owner robot = *replica.directory.owner("robot");
  CHECK(replica.directory.epoch(robot) == pages.epoch());
  CHECK(replica.directory.info(robot).frames == owned.size());
  CHECK(pages.count() >= 3);
}

}  // namespace
}  // namespace tfdude
