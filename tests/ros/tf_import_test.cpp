#include "tfdude-ros/logic/tf_import.hpp"

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::ros {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ContainsSubstring;
using Kind = TfImport::Edit::Kind;

Time at(double s) { return time_of(1'000'000'000 + static_cast<std::int64_t>(s * 1e9)); }

TransformStamped edge(const std::string& parent, const std::string& child, double stamp,
                      double x = 0) {
  return {at(stamp), parent, child, {{x, 0, 0}, {0, 0, 0, 1}}};
}

/// An import with a clock of its own, and frames that belong to others.
struct Rig {
  explicit Rig(ImportSettings settings = {}) : import(std::move(settings)) {}

  TfImport::Changes take(const TfMessage& message, const std::string& writer = "w1",
                         bool is_static = false) {
    return import.take(message, writer, is_static, now, holder(), arrival);
  }
  TfImport::Changes retry() { return import.retry(now, holder()); }

  TfImport::WhoHolds holder() {
    return [this](const std::string& id) {
      const auto found = holdings.find(id);
      return found == holdings.end() ? Holding() : found->second;
    };
  }

  TfImport import;
  TfImport::SteadyTime now{std::chrono::hours(1)};
  std::optional<Time> arrival;
  std::map<std::string, Holding> holdings;
};

std::string text(const TfImport::Changes& changes) {
  std::string out;
  for (const auto& edit : changes.edits) {
    const char* const names[] = {"root ", "add ", "move ", "clear "};
    out += names[static_cast<int>(edit.kind)] + edit.id +
           (edit.parent.empty() ? "" : " under " + edit.parent) + "; ";
  }
  for (const auto& batch : changes.batches) {
    out += batch.stamp ? "at " + std::to_string(nanoseconds(*batch.stamp) / 1'000'000 - 1000)
                       : std::string("always");
    for (const auto& one : batch.edges) out += " " + one.id;
    out += "; ";
  }
  return out;
}

}  // namespace

TEST_CASE("ros import: a new frame is added, with its parent as a root, then updated") {
  Rig rig;
  CHECK(text(rig.take({edge("/odom", "/base", 1)})) ==
        "root odom; add base under odom; at 1000 base; ");
  CHECK(text(rig.take({edge("odom", "base", 2)})) == "at 2000 base; ");
  CHECK(rig.import.counts().taken == 2);
}

TEST_CASE("ros import: a covariance is unspecified unless the settings give one") {
  Rig plain;
  CHECK(!plain.take({edge("a", "b", 1)}).batches[0].edges[0].X_PC.covariance.complete());
  ImportSettings settings;
  settings.covariance = *Covariance::from_stddev({1, 1, 1, 2, 2, 2});
  Rig given(settings);
  CHECK(given.take({edge("a", "b", 1)}).batches[0].edges[0].X_PC.covariance.complete());
}

TEST_CASE("ros import: a parent that becomes a child is moved, not added") {
  Rig rig;
  (void)rig.take({edge("odom", "base", 1)});
  CHECK(text(rig.take({edge("map", "odom", 1)})) ==
        "root map; move odom under map; at 1000 odom; ");
}

TEST_CASE("ros import: transforms of one stamp are one batch, in the order of the message") {
  Rig rig;
  CHECK(
      text(rig.take({edge("a", "b", 1), edge("b", "c", 1), edge("c", "d", 2), edge("a", "b", 2),
                     edge("a", "b", 2)})) ==
      "root a; add b under a; add c under b; add d under c; at 1000 b c; at 2000 d b; at 2000 b; ");
}

TEST_CASE("ros import: the work for a message grows with its size, not with the square of it") {
  Rig rig;
  TfMessage message;
  for (int i = 0; i < 40'000; ++i) message.push_back(edge("world", "f" + std::to_string(i), 1));
  const auto start = std::chrono::steady_clock::now();
  const auto changes = rig.take(message);
  CHECK(std::chrono::steady_clock::now() - start < seconds(3));
  REQUIRE(changes.batches.size() == 1);
  CHECK(changes.batches[0].edges.size() == message.size());
}

TEST_CASE("ros import: static transforms have no stamp, and are written only if they change") {
  Rig rig;
  CHECK(text(rig.take({edge("base", "lidar", 1)}, "w1", true)) ==
        "root base; add lidar under base; ");
  CHECK(rig.take({edge("base", "lidar", 9)}, "w1", true).empty());
  CHECK(text(rig.take({edge("base", "lidar", 9, 0.5)}, "w1", true)) == "always lidar; ");
  // The edge becomes dynamic by its first sample, and static again by dropping them.
  CHECK(text(rig.take({edge("base", "lidar", 10)})) == "at 10000 lidar; ");
  CHECK(text(rig.take({edge("base", "lidar", 11)}, "w1", true)) == "move lidar under base; ");
}

TEST_CASE("ros import: a frame with another parent is moved") {
  Rig rig;
  (void)rig.take({edge("table", "cup", 1)});
  CHECK(text(rig.take({edge("hand", "cup", 2)})) ==
        "root hand; move cup under hand; at 2000 cup; ");
  CHECK(text(rig.take({edge("hand", "cup", 3)})) == "at 3000 cup; ");
}

TEST_CASE("ros import: two publishers of one frame are reported once, with both") {
  Rig rig;
  (void)rig.take({edge("odom", "base", 1)}, "w1");
  const auto second = rig.take({edge("odom", "base", 1.1)}, "w2");
  CHECK(text(second) == "at 1100 base; ");
  REQUIRE(second.reports.size() == 1);
  CHECK_THAT(second.reports[0], ContainsSubstring("w1") && ContainsSubstring("w2"));
  CHECK(rig.take({edge("odom", "base", 1.2)}, "w1").reports.empty());
}

TEST_CASE("ros import: of two active publishers the first decides about the parent") {
  Rig rig;
  (void)rig.take({edge("odom", "base", 1)}, "w1");
  CHECK(rig.take({edge("map", "base", 1.1)}, "w2").batches.empty());
  CHECK(rig.import.counts().contested == 1);
  rig.now += milliseconds(900);
  (void)rig.take({edge("odom", "base", 2)}, "w1");
  rig.now += milliseconds(900);
  CHECK(rig.take({edge("map", "base", 3)}, "w2").batches.empty());
  // Now the first one is silent.
  rig.now += milliseconds(200);
  CHECK(text(rig.take({edge("map", "base", 4)}, "w2")) == "move base under map; at 4000 base; ");
}

TEST_CASE("ros import: a jump back of time drops the samples") {
  Rig rig;
  (void)rig.take({edge("odom", "base", 100)});
  const auto late = rig.take({edge("odom", "base", 99.5)});
  CHECK(text(late) == "at 99500 base; ");
  const auto jump = rig.take({edge("odom", "base", 5)});
  CHECK(text(jump) == "clear base under odom; at 5000 base; ");
  REQUIRE(jump.reports.size() == 1);
  CHECK_THAT(jump.reports[0], ContainsSubstring("jumped back"));
  CHECK(text(rig.take({edge("odom", "base", 6)})) == "at 6000 base; ");
  // A bag that starts again has another writer.
  rig.now += seconds(2);
  CHECK(text(rig.take({edge("odom", "base", 1)}, "w2")) == "clear base under odom; at 1000 base; ");
  // The clock of one of two active publishers may be wrong.
  CHECK(text(rig.take({edge("odom", "base", -900)}, "w3")) == "at -900000 base; ");
}

TEST_CASE("ros import: a sample without a stamp is of the time of its arrival") {
  Rig rig;
  const auto unstamped = [](double x) {
    return TransformStamped{Time(), "map", "odom", {{x, 0, 0}, {0, 0, 0, 1}}};
  };
  // A clock from outside may have no time yet.
  for (int i = 0; i < 2; ++i) {
    const auto changes = rig.take({unstamped(0)});
    CHECK(changes.empty());
    CHECK(changes.reports.size() == (i == 0 ? 2 : 0));
  }
  CHECK(rig.import.counts().timeless == 2);
  rig.arrival = at(1);
  CHECK(text(rig.take({unstamped(0), edge("odom", "base", 0.5)})) ==
        "root map; add odom under map; add base under odom; at 1000 odom; at 500 base; ");
  rig.arrival = at(2);
  const auto next = rig.take({unstamped(1)});
  CHECK(text(next) == "at 2000 odom; ");
  CHECK(next.reports.empty());
  // While the clock stands still, the partition replaces the sample.
  const auto still = rig.take({unstamped(2)});
  CHECK(text(still) == "always odom; ");
  CHECK(still.batches[0].edges[0].X_PC.pose.translation().x() == 2);
  rig.arrival = at(3);
  CHECK(text(rig.take({edge("base", "odom", 2.5)}, "w1")) ==
        "move odom under base; at 2500 odom; ");
  CHECK(text(rig.take({unstamped(3)})) == "move odom under map; at 3000 odom; ");
  CHECK(rig.import.stamps().counts().unstamped == 6);
  // A static one holds for all times anyway.
  auto mast = unstamped(1);
  mast.child = "mast";
  CHECK(text(rig.take({mast}, "w1", true)) == "add mast under map; ");
  CHECK(rig.import.stamps().counts().unstamped == 6);
}

TEST_CASE("ros import: stamps that the partition rejects are counted by kind, and reported once") {
  Rig rig;
  (void)rig.take({edge("a", "b", 1), edge("a", "c", 1)});
  const auto reports = [&](const std::string& id, Errc code) {
    return rig.import.rejected_sample(id, {code, "the stamp 1.000 s"});
  };
  const auto first = reports("b", Errc::kStampTaken);
  REQUIRE(first);
  CHECK_THAT(*first, ContainsSubstring("'b'") && ContainsSubstring("another value") &&
                         ContainsSubstring("1.000 s"));
  CHECK(reports("c", Errc::kStampTaken));
  CHECK(!reports("b", Errc::kStampTaken));
  CHECK_THAT(*reports("b", Errc::kTooOld), ContainsSubstring("'b'"));
  CHECK(!reports("b", Errc::kTooOld));
  CHECK(reports("b", Errc::kInvalidInput));
  rig.import.repeated_alike();
  CHECK(rig.import.stamps().summary() == "unstamped=0 same=1 repeated=3 old=2 early=1");
  CHECK(text(rig.take({edge("a", "b", 2)})) == "at 2000 b; ");
}

TEST_CASE("ros import: frames of other partitions are never taken") {
  Rig rig;
  rig.holdings["tool"] = {Holding::Kind::kOther, "arm"};
  const auto first = rig.take({edge("base", "tool", 1)}, "w1");
  CHECK(first.empty());
  REQUIRE(first.reports.size() == 1);
  CHECK_THAT(first.reports[0], ContainsSubstring("arm") && ContainsSubstring("w1"));
  CHECK(rig.take({edge("base", "tool", 2)}, "w1").reports.empty());
  CHECK(rig.import.counts().owned == 2);
  // But frames may be below theirs, which are not added.
  CHECK(text(rig.take({edge("tool", "tip", 1)})) == "add tip under tool; at 1000 tip; ");
}

TEST_CASE(
    "ros import: a frame that may belong to an absent partition is taken once that is known") {
  Rig rig;
  rig.holdings["tool"] = {Holding::Kind::kUnknown, "partition 'arm' is lost"};
  CHECK(rig.take({edge("base", "tool", 1)}, "w1", true).empty());
  CHECK(rig.take({edge("tool", "tip", 1)}, "w1", true).empty());
  CHECK(rig.retry().empty());
  rig.holdings.clear();
  CHECK(text(rig.retry()) == "root tool; add tip under tool; root base; move tool under base; ");
  CHECK(rig.retry().empty());
}

TEST_CASE("ros import: of what others publish no more is kept than is of use") {
  Rig rig;
  rig.holdings["base"] = {Holding::Kind::kOther, "robot"};
  (void)rig.take({edge("world", "/base", 1, 1), edge("world", "//base", 1, 2)}, "w1", true);
  for (int i = 0; i < 10'050; ++i) {
    const std::string id = "f" + std::to_string(i);
    rig.holdings[id] = {Holding::Kind::kOther, "robot"};
    (void)rig.take({edge("world", id, 1)}, "w1", true);
  }
  rig.holdings.clear();
  const auto changes = rig.retry();
  CHECK(changes.edits.size() == 10'000 + 1);
  REQUIRE(changes.edits[1].id == "base");
  CHECK(changes.edits[1].X_PC->pose.translation().x() == 2);
  // Of long names only the part that the log shows.
  Rig other;
  const std::string name(400, 'x');
  CHECK(other.take({edge("world", name + "a", 1)}).reports.size() == 1);
  CHECK(other.take({edge("world", name + "b", 1)}).reports.empty());
}

TEST_CASE("ros import: wrong names and values are counted and reported once, by name") {
  Rig rig;
  auto twisted = edge("a", "b", 1);
  twisted.pose.quat = {0, 0, 0, 2};
  for (int i = 0; i < 3; ++i) {
    const auto changes = rig.take(
        {edge("a", std::string(256, 'x'), 1), edge("", "b", 1), twisted, edge("c", "/c", 1)});
    CHECK(changes.empty());
    CHECK(changes.reports.size() == (i == 0 ? 4 : 0));
  }
  CHECK(rig.import.counts().names == 6);
  CHECK(rig.import.counts().values == 6);
  CHECK(rig.import.counts().taken == 0);
}

TEST_CASE("ros import: patterns choose frames, and a prefix is added to all names") {
  ImportSettings settings;
  settings.frames = {Patterns({"base*"}), Patterns({"*_old"})};
  settings.prefix = "r1/";
  Rig rig(settings);
  CHECK(text(rig.take(
            {edge("odom", "/base", 1), edge("odom", "base_old", 1), edge("odom", "other", 1)})) ==
        "root r1/odom; add r1/base under r1/odom; at 1000 r1/base; ");
}

TEST_CASE("ros import: after a rejected change a frame starts over") {
  Rig rig;
  (void)rig.take({edge("a", "b", 1)});
  CHECK(rig.import.rejected_sample("b", {Errc::kTooOld, "old"}));
  CHECK(text(rig.take({edge("a", "b", 2)})) == "at 2000 b; ");
  CHECK(rig.import.rejected("b", {Errc::kUnknownFrame, "no frame 'b'"}));
  CHECK(text(rig.take({edge("a", "b", 3)})) == "add b under a; at 3000 b; ");
  CHECK(!rig.import.rejected("b", {Errc::kUnknownFrame, "no frame 'b'"}));
  // If it is still in the partition, it cannot be added.
  rig.holdings["b"] = {Holding::Kind::kBridge};
  CHECK(text(rig.take({edge("a", "b", 4)})) == "move b under a; at 4000 b; ");
  CHECK(rig.import.counts().rejected == 2);
}

TEST_CASE("ros import: frames of a description are given up, and what is below them stays") {
  Rig rig;
  CHECK(text(rig.take({edge("odom", "base", 1), edge("base", "arm", 1), edge("arm", "eye", 1)})) ==
        "root odom; add base under odom; add arm under base; add eye under arm; "
        "at 1000 base arm eye; ");
  CHECK(rig.import.give_up({"arm", "hand"}) == std::vector<std::string>{"arm"});
  // Nobody has it yet; also a static transform of it waits, and is not taken later.
  CHECK(text(rig.take({edge("base", "arm", 2), edge("arm", "eye", 2)})) == "");
  CHECK(text(rig.take({edge("arm", "hand", 2)}, "w1", true)) == "");
  rig.holdings["arm"] = rig.holdings["hand"] = {Holding::Kind::kOther, "robot"};
  CHECK(text(rig.retry()) == "");
  CHECK(text(rig.take({edge("base", "arm", 3), edge("arm", "eye", 3)})) == "at 3000 eye; ");
  // The next description has other frames.
  rig.holdings.clear();
  CHECK(rig.import.give_up({}).empty());
  CHECK(text(rig.take({edge("base", "arm", 4)})) == "add arm under base; at 4000 arm; ");
}

}  // namespace tfdude::ros
