#include "partition/partition.hpp"

#include <chrono>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::outcome;
using testing::Replica;
using testing::x_of;
using Lines = std::vector<std::string>;

constexpr Time kNow{std::chrono::seconds(100)};
constexpr std::uint64_t kLife = 7;  // the incarnation, from which epochs count

// The partition "arms" of a process that also knows world and base of "robot".
struct Arms : Replica {
  Arms() : Replica("arms"), partition("arms", kLife, forest, directory) {
    directory.apply(Page{"robot", 0, 1, 1, {{"world", ""}, {"base", "world"}}});
  }

  // base - arm +- hand - tool
  //            +- camera
  void plant() {
    REQUIRE(partition.load({{"arm", "base", along_x(1)},
                            {"hand", "arm", along_x(10)},
                            {"tool", "hand", along_x(100)},
                            {"camera", "arm", along_x(1000)}},
                           kNow));
    (void)partition.take_pages();
  }

  template <class Body>
  Reply ask(const std::string& id, Body body) {
    return partition.answer(Request{++sequence, id, std::move(body)}, kNow);
  }

  Partition partition;
  std::uint32_t sequence = 0;
};

// "ok", or the error's name and message.
std::string said(const Reply& reply) {
  const auto* error = std::get_if<Error>(&reply.body);
  return error == nullptr ? "ok" : std::string(to_string(error->code)) + ": " + error->message;
}

// ---- load

TEST_CASE("a configuration may list frames in any order and with unknown parents") {
  Arms arms;
  REQUIRE(arms.partition.load(
      {{"tool", "hand", along_x(3)}, {"arm", "base", along_x(1)}, {"hand", "arm", along_x(2)}},
      kNow));
  REQUIRE(arms.partition.load({{"lamp", "ceiling", along_x(1)}, {"island", "", along_x(1)}}, kNow));
  CHECK(arms.structure() == Lines{"arm < base @ arms, attached", "base < world @ robot, attached",
                                  "hand < arm @ arms, attached", "island <  @ arms",
                                  "lamp < ceiling @ arms", "tool < hand @ arms, attached",
                                  "world <  @ robot"});
  CHECK(x_of(arms.forest.lookup("arm", "tool")) == 5);
  CHECK(arms.partition.frame_count() == 5);
  CHECK(arms.partition.page_count() == 1);
}

TEST_CASE("a configuration with a bad frame is rejected as a whole and the frame is named") {
  struct Bad {
    std::vector<FrameSpec> frames;
    std::string error;
    std::string named;
  };
  const std::vector<Bad> all{
      {{{"a", "", {}}, {"b", "a", {}}, {"a", "", {}}}, "already_exists", "'a'"},
      {{{"a", "", {}}, {"base", "", {}}}, "already_exists", "'base'"},
      {{{"a", "", {}}, {"b\n", "a", {}}}, "invalid_input", "id"},
      {{{"a", "", {}}, {"", "a", {}}}, "invalid_input", "id"},
      {{{"a", "", {}}, {"a ", "a", {}}}, "invalid_input", "id 'a ' ends with a space"},
      {{{"a", "", {}}, {"b", std::string(256, 'p'), {}}}, "invalid_input", "parent"},
      {{{"a", "b", {}}, {"b", "a", {}}}, "cycle", "'b'"},
      {{{"b", "a", {}}, {"a", "a", {}}}, "cycle", "'a'"},
  };
  for (const Bad& bad : all) {
    Arms arms;
    const Lines before = arms.structure();
    const auto loaded = arms.partition.load(bad.frames, kNow);
    CHECK(outcome(loaded) == bad.error);
    CAPTURE(loaded.error().message);
    CHECK(loaded.error().message.find(bad.named) != std::string::npos);
    CHECK(arms.structure() == before);
    CHECK(arms.partition.frame_count() == 0);
    CHECK(arms.partition.take_pages().empty());
    // The frames can be loaded afterwards.
    CHECK(outcome(arms.partition.load({{"a", "", {}}, {"b", "a", {}}}, kNow)) == "ok");
  }
}

TEST_CASE("loaded frames are published once as one epoch") {
  Arms arms;
  std::vector<FrameSpec> frames;
  for (int i = 0; i < 100; ++i) frames.push_back({"f" + std::to_string(i), "arm", {}});
  REQUIRE(arms.partition.load(frames, kNow));
  const auto pages = arms.partition.take_pages();
  REQUIRE(pages.size() > 2);
  for (const Page& page : pages) CHECK(page.epoch == kLife + 1);
  CHECK(arms.partition.take_pages().empty());
  Replica other;
  other.apply(pages);
  CHECK(other.forest.frames().size() == 100);
}

// ---- add

TEST_CASE("a frame is added below an own frame or below another's or as a root") {
  Arms arms;
  arms.plant();
  CHECK(said(arms.ask("finger", AddRequest{"hand", along_x(5)})) == "ok");
  CHECK(said(arms.ask("rail", AddRequest{"world", along_x(6)})) == "ok");
  CHECK(said(arms.ask("island", AddRequest{"", along_x(7)})) == "ok");
  CHECK(x_of(arms.forest.lookup("arm", "finger")) == 15);
  CHECK(arms.partition.frame_count() == 7);
}

TEST_CASE("an add is rejected with the frame and the reason") {
  Arms arms;
  arms.plant();
  const Lines before = arms.structure();
  CHECK(said(arms.ask("hand", AddRequest{"arm", {}})) ==
        "already_exists: frame 'hand' exists already");
  CHECK(said(arms.ask("base", AddRequest{"arm", {}})) ==
        "already_exists: frame 'base' exists already");
  CHECK(said(arms.ask("finger", AddRequest{"fist", {}})) ==
        "unknown_parent: no frame 'fist' to be the parent of 'finger'");
  CHECK(said(arms.ask("\x7f", AddRequest{"arm", {}})).rfind("invalid_input: id", 0) == 0);
  CHECK(said(arms.ask("hand ", AddRequest{"arm", {}})) ==
        "invalid_input: id 'hand ' ends with a space");
  CHECK(said(arms.ask("a", AddRequest{"\n", {}})).rfind("invalid_input: parent", 0) == 0);
  CHECK(arms.structure() == before);
  CHECK(arms.partition.take_pages().empty());
}

// ---- remove

TEST_CASE("frames are removed with all that is owned below them") {
  Arms arms;
  arms.plant();
  CHECK(said(arms.ask("hand", RemoveRequest{{"hand", "camera"}})) == "ok");
  CHECK(arms.partition.frame_count() == 1);
  CHECK_FALSE(arms.forest.exists("tool"));
  const auto pages = arms.partition.take_pages();
  REQUIRE(pages.size() == 1);
  REQUIRE(pages[0].entries.size() == 1);
  CHECK(pages[0].entries[0].id == "arm");
}

TEST_CASE("a removal removes the owned frames and names the first that is not owned") {
  Arms arms;
  arms.plant();
  const std::uint64_t epoch = arms.ask("arm", UpdateRequest{{{"arm", {}}}}).epoch;
  const Reply reply = arms.ask("hand", RemoveRequest{{"base", "hand", "nobody", "camera"}});
  CHECK(said(reply) == "not_owner: partition 'arms' does not own frame 'base' (any more)");
  CHECK(reply.epoch == epoch + 1);
  CHECK(arms.partition.frame_count() == 1);
  CHECK(arms.forest.exists("base"));
  const Reply again = arms.ask("nobody", RemoveRequest{{"nobody"}});
  CHECK(said(again) == "not_owner: partition 'arms' does not own frame 'nobody' (any more)");
  CHECK(again.epoch == epoch + 1);
}

TEST_CASE("another claim to a removed frame comes into force") {
  Arms arms;
  arms.plant();
  arms.directory.apply(Page{"legs", 0, 1, 1, {{"tool", "foot"}}});
  CHECK(arms.forest.info("tool")->owner == kHeldHere);
  CHECK(said(arms.ask("hand", RemoveRequest{{"hand"}})) == "ok");
  CHECK(arms.directory.name(arms.forest.info("tool")->owner) == "legs");
  CHECK(arms.forest.info("tool")->parent == "foot");
}

// ---- move

TEST_CASE("a frame is moved with or without a new value") {
  Arms arms;
  arms.plant();
  CHECK(said(arms.ask("hand", MoveRequest{"camera", {}})) == "ok");
  CHECK(x_of(arms.forest.lookup("camera", "tool")) == 110);
  CHECK(said(arms.ask("hand", MoveRequest{"world", along_x(7)})) == "ok");
  CHECK(x_of(arms.forest.value("hand")) == 7);
  CHECK(said(arms.ask("hand", MoveRequest{"", {}})) == "ok");
  CHECK(arms.forest.roots() == Lines{"hand", "world"});
}

TEST_CASE("a move is rejected with the frame and the reason") {
  Arms arms;
  arms.plant();
  const Lines before = arms.structure();
  const std::string foreign = "not_owner: partition 'arms' does not own frame ";
  CHECK(said(arms.ask("base", MoveRequest{"", {}})) == foreign + "'base' (any more)");
  CHECK(said(arms.ask("nobody", MoveRequest{"", {}})) == foreign + "'nobody' (any more)");
  CHECK(said(arms.ask("hand", MoveRequest{"fist", {}})) ==
        "unknown_parent: no frame 'fist' to be the parent of 'hand'");
  CHECK(said(arms.ask("arm", MoveRequest{"tool", {}})) ==
        "cycle: frame 'arm' cannot be moved under 'tool', which lies below it");
  CHECK(said(arms.ask("arm", MoveRequest{"\n", {}})).rfind("invalid_input: parent", 0) == 0);
  CHECK(arms.structure() == before);
  CHECK(arms.partition.take_pages().empty());
}

// ---- update

TEST_CASE("an update changes all edges or none and names the first frame that is not owned") {
  Arms arms;
  arms.plant();
  CHECK(said(arms.ask("arm", UpdateRequest{{{"arm", along_x(2)}, {"hand", along_x(3)}}})) == "ok");
  CHECK(x_of(arms.forest.value("arm")) == 2);
  CHECK(x_of(arms.forest.value("hand")) == 3);
  const std::string foreign = GENERATE(as<std::string>{}, "base", "nobody");
  CHECK(said(arms.ask("arm", UpdateRequest{{{"arm", {}}, {foreign, {}}, {"hand", {}}}})) ==
        "not_owner: partition 'arms' does not own frame '" + foreign + "' (any more)");
  CHECK(x_of(arms.forest.value("arm")) == 2);
  CHECK(x_of(arms.forest.value("hand")) == 3);
}

TEST_CASE("a streamed update changes the owned edges and ignores the others") {
  Arms arms;
  arms.plant();
  CHECK(arms.partition.apply(Update{{{"arm", along_x(5)}, {"hand", along_x(6)}}}) == 2);
  CHECK(arms.partition.apply(
            Update{{{"base", along_x(9)}, {"arm", along_x(7)}, {"nobody", along_x(9)}}}) == 1);
  CHECK(x_of(arms.forest.value("arm")) == 7);
  CHECK(x_of(arms.forest.value("hand")) == 6);
  CHECK(arms.partition.apply(Update{{{"base", along_x(9)}}}) == 0);
  CHECK(arms.partition.apply(Update{}) == 0);
}

// ---- lookup

TEST_CASE("a lookup is answered with one transform per segment") {
  Arms arms;
  arms.plant();
  const Reply reply = arms.ask(
      "tool",
      LookupRequest{{{"tool", "arm"}, {"base", "hand"}, {"camera", "tool"}, {"arm", "arm"}}});
  CHECK(reply.sequence == 1);
  const auto* found = std::get_if<SegmentValues>(&reply.body);
  REQUIRE(found != nullptr);
  const auto* transforms = &found->values;
  REQUIRE(transforms->size() == 4);
  CHECK((*transforms)[0].pose.translation().x() == -110);
  CHECK((*transforms)[1].pose.translation().x() == 11);
  CHECK((*transforms)[2].pose.translation().x() == -890);
  CHECK((*transforms)[3].pose.translation().x() == 0);
}

TEST_CASE("a lookup over an edge that is not owned is rejected and names the ends") {
  Arms arms;
  arms.plant();
  const std::string start = "not_owner: partition 'arms' does not own the path from ";
  CHECK(said(arms.ask("hand", LookupRequest{{{"arm", "hand"}, {"world", "hand"}}}))
            .rfind(start + "'world' to 'hand'", 0) == 0);
  CHECK(said(arms.ask("hand", LookupRequest{{{"nobody", "hand"}}}))
            .rfind(start + "'nobody' to 'hand'", 0) == 0);
  REQUIRE(said(arms.ask("island", AddRequest{"", {}})) == "ok");
  CHECK(said(arms.ask("hand", LookupRequest{{{"island", "hand"}}}))
            .rfind(start + "'island' to 'hand'", 0) == 0);
}

// Once, the owner looked up each of 4096 segments of 3000 edges, for 0.4 s, to name the one that it
// does not own.
TEST_CASE("a source that is named as those of joints is rejected for other edges") {
  Arms arms;
  arms.plant();
  const Correlation said{false, {{"joint supply", false, Loading::Ones(6, 1)}}, {}};
  const std::string why = "names with this prefix are reserved for joints";
  FrameSpec named{"lamp", "arm", Transform::exact({})};
  named.correlation = said;
  const auto loaded = arms.partition.load({named}, kNow);
  REQUIRE_FALSE(loaded);
  CHECK(loaded.error().message.find(why) != std::string::npos);
  const Reply reply = arms.ask("arm", CorrelateRequest{said});
  const auto* error = std::get_if<Error>(&reply.body);
  REQUIRE(error != nullptr);
  CHECK(error->code == Errc::kInvalidInput);
  CHECK(error->message.find(why) != std::string::npos);
}

TEST_CASE("a lookup of too many edges is rejected at once, whatever is wrong with it") {
  constexpr int kDeep = 3000;
  Arms arms;
  std::vector<FrameSpec> chain{{"f0", "base", along_x(1)}};
  for (int i = 1; i <= kDeep; ++i) {
    chain.push_back({"f" + std::to_string(i), "f" + std::to_string(i - 1), along_x(1)});
  }
  REQUIRE(arms.partition.load(chain, kNow));
  std::vector<PathEnds> segments(4096, {"f0", "f" + std::to_string(kDeep)});
  const auto ask = [&] {
    const auto start = std::chrono::steady_clock::now();
    const std::string answer = said(arms.ask("f0", LookupRequest{segments}));
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::milliseconds(100));
    return answer;
  };
  CHECK(ask() == "too_much: partition 'arms': the 4096 segments have more than 65536 edges");
  segments.back().to = "nobody";
  CHECK(ask() ==
        "not_owner: partition 'arms' does not own all of the path: no frame 'nobody' to end at");
  segments.front().to = "nobody";
  CHECK(ask().rfind("not_owner: partition 'arms' does not own the path from 'f0' to 'nobody'", 0) ==
        0);
}

// ---- repetition and epochs

TEST_CASE("a repeated request is answered again but not applied again") {
  Arms arms;
  arms.plant();
  const PeerId peer{1};
  const Request add{5, "finger", AddRequest{"hand", along_x(1)}};
  const Reply first = arms.partition.answer(peer, add, kNow);
  CHECK(said(first) == "ok");
  CHECK(said(arms.ask("hand", RemoveRequest{{"finger"}})) == "ok");
  const Reply second = arms.partition.answer(peer, add, kNow);
  CHECK(said(second) == "ok");
  CHECK(second.sequence == 5);
  CHECK(second.epoch == first.epoch);
  CHECK_FALSE(arms.forest.exists("finger"));
  // With another peer or another number it is another request.
  CHECK(said(arms.partition.answer(PeerId{2}, add, kNow)) == "ok");
  CHECK(arms.forest.exists("finger"));
  const Request repeated{6, "finger", AddRequest{"hand", along_x(1)}};
  const std::string refused = "already_exists: frame 'finger' exists already";
  CHECK(said(arms.partition.answer(peer, repeated, kNow)) == refused);
  REQUIRE(said(arms.ask("finger", RemoveRequest{{"finger"}})) == "ok");
  CHECK(said(arms.partition.answer(peer, repeated, kNow)) == refused);
}

TEST_CASE("a partial update is applied only if all its edges are owned") {
  Arms arms;
  arms.plant();
  const Eigen::Vector3d there(1, 2, 3);
  const auto ask = [&](const std::vector<PartialUpdate>& edges) {
    return said(arms.ask(edges.front().id, PartialUpdateRequest{edges}));
  };
  const Covariance sigma = *Covariance::from_stddev({1, 1, 1, 1, 1, 1});
  CHECK(ask({{"hand", {{}, {}, sigma}}}) == "ok");
  CHECK(ask({{"hand", {there}}, {"tool", {there}}}) == "ok");
  const auto hand = arms.forest.lookup("arm", "hand");
  CHECK(hand->pose.translation() == there);
  CHECK(hand->covariance.of_specified().upper() == sigma.upper());
  CHECK(ask({{"hand", {Eigen::Vector3d(9, 9, 9)}}, {"world", {there}}}).rfind("not_owner", 0) == 0);
  CHECK(arms.forest.lookup("arm", "hand")->pose.translation() == there);
}

TEST_CASE("a repeated lookup is answered with the current value") {
  Arms arms;
  arms.plant();
  const PeerId peer{1};
  const Request lookup{9, "hand", LookupRequest{{{"arm", "hand"}}}};
  const auto x = [&] {
    const Reply reply = arms.partition.answer(peer, lookup, kNow);
    return std::get<SegmentValues>(reply.body).values.at(0).pose.translation().x();
  };
  CHECK(x() == 10);
  REQUIRE(said(arms.ask("hand", UpdateRequest{{{"hand", along_x(20)}}})) == "ok");
  CHECK(x() == 20);
}

TEST_CASE("the epoch advances only with the structure") {
  Arms arms;
  arms.plant();
  CHECK(arms.ask("arm", UpdateRequest{{{"arm", {}}}}).epoch == kLife + 1);
  CHECK(arms.ask("arm", LookupRequest{{{"arm", "hand"}}}).epoch == 0);  // reads tell no epoch
  CHECK(arms.ask("hand", AddRequest{"arm", {}}).epoch == kLife + 1);    // rejected
  CHECK(arms.partition.take_pages().empty());
  CHECK(arms.ask("finger", AddRequest{"hand", {}}).epoch == kLife + 2);
  CHECK(arms.ask("finger", MoveRequest{"arm", {}}).epoch == kLife + 3);
  CHECK(arms.ask("finger", RemoveRequest{{"finger", "camera"}}).epoch == kLife + 4);
  const auto pages = arms.partition.take_pages();
  REQUIRE(pages.size() == 1);
  CHECK(pages[0].epoch == kLife + 4);
  CHECK(pages[0].partition == "arms");
}

TEST_CASE("a partition without pages tells no epoch that others could wait for") {
  Arms arms;
  REQUIRE(arms.partition.load({}, kNow));
  REQUIRE(arms.partition.take_pages().empty());
  CHECK(arms.ask("arms", RemoveRequest{}).epoch == 0);
  CHECK(arms.ask("arms", ForgetRequest{"legs", 1}).epoch == 0);
  const std::uint64_t first = arms.ask("arm", AddRequest{"", {}}).epoch;
  CHECK(first > kLife);
  CHECK(arms.partition.take_pages().at(0).epoch == first);
}

}  // namespace
}  // namespace tfdude
