#include "partition/routing.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "partition/assembly.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::outcome;
using testing::presence_of;
using testing::Replica;
using Lines = std::vector<std::string>;

constexpr Time kNow{std::chrono::milliseconds(1500)};

// world(robot) - base(robot) +- arm(arms) - hand(arms) - ring(legs) - gem(arms)
//                            +- leg(legs) - foot(legs)
// and island(legs) apart. The process itself serves `own`.
struct Known : Replica {
  explicit Known(const std::string& own = {}) : Replica(own) {
    const std::vector<PageEntry> robot{{"world", ""}, {"base", "world"}};
    const std::vector<PageEntry> arms{{"arm", "base"}, {"hand", "arm"}, {"gem", "ring"}};
    const std::vector<PageEntry> legs{
        {"leg", "base"}, {"foot", "leg"}, {"ring", "hand"}, {"island", ""}};
    for (const auto& [name, frames] :
         {std::pair("robot", robot), std::pair("arms", arms), std::pair("legs", legs)}) {
      if (own == name) {
        for (const PageEntry& entry : frames) {
          REQUIRE(forest.add(entry.id, entry.parent, along_x(1), Forest::MissingParent::kAllow));
        }
      } else {
        directory.apply(presence_of(name, 1, 1), kNow);
        directory.apply(Page{name, 0, 1, 1, frames});
      }
    }
  }

  void lose(const std::string& partition) { REQUIRE(directory.lost(partition, 1, kNow)); }
};

// "partition[id]: what is asked" of each part.
std::string text(const Part& part) {
  std::string body;
  if (const auto* add = std::get_if<AddRequest>(&part.request.body)) {
    body = "add below " + add->parent;
  } else if (const auto* remove = std::get_if<RemoveRequest>(&part.request.body)) {
    body = "remove";
    for (const std::string& top : remove->tops) body += " " + top;
  } else if (const auto* update = std::get_if<UpdateRequest>(&part.request.body)) {
    body = "update";
    for (const EdgeUpdate& edge : update->edges) body += " " + edge.id;
  } else if (const auto* move = std::get_if<MoveRequest>(&part.request.body)) {
    body = "move below " + move->parent + (move->X_PC.empty() ? "" : " with value");
  } else {
    body = "lookup";
    for (const PathEnds& ends : std::get<LookupRequest>(part.request.body).segments) {
      body += " " + ends.from + ">" + ends.to;
    }
  }
  return part.partition + "[" + part.request.id + "]: " + body;
}

Lines texts(const std::vector<Part>& parts) {
  Lines lines;
  for (const Part& part : parts) lines.push_back(text(part));
  return lines;
}

template <class T>
std::string message_of(const Result<T>& result) {
  return result ? "ok" : result.error().message;
}

constexpr const char* kLegsLost =
    "partition 'legs' (host host-of-legs, pid 4711) has not been reachable since "
    "1970-01-01 00:00:01.500 UTC: it is lost";

// ---- add

TEST_CASE("a new frame goes to its parent's owner or to the named partition") {
  const Known known;
  const auto by_parent = route_add(known.forest, known.directory, "nail", {"hand", {}}, "");
  REQUIRE(by_parent);
  CHECK(text(*by_parent) == "arms[nail]: add below hand");
  CHECK(by_parent->owner == *known.directory.owner("arms"));
  const auto by_name = route_add(known.forest, known.directory, "nail", {"hand", {}}, "legs");
  REQUIRE(by_name);
  CHECK(text(*by_name) == "legs[nail]: add below hand");
  const auto root = route_add(known.forest, known.directory, "moon", {"", {}}, "robot");
  REQUIRE(root);
  CHECK(text(*root) == "robot[moon]: add below ");
}

TEST_CASE("a root without a partition goes to the own partition if there is one") {
  const Known arms("arms");
  const auto own = route_add(arms.forest, arms.directory, "moon", {"", {}}, "");
  REQUIRE(own);
  CHECK(own->owner == kHeldHere);
  CHECK(text(*own) == "arms[moon]: add below ");
  const Known client;
  const auto nobodys = route_add(client.forest, client.directory, "moon", {"", {}}, "");
  CHECK(outcome(nobodys) == "invalid_input");
  CHECK(message_of(nobodys) == "frame 'moon' needs a parent or a partition to belong to");
}

TEST_CASE("an add that cannot succeed is not sent") {
  Known known;
  const auto add = [&](const std::string& id, const std::string& parent,
                       const std::string& partition) {
    const auto part = route_add(known.forest, known.directory, id, {parent, {}}, partition);
    return outcome(part) + ": " + message_of(part);
  };
  CHECK(add("hand", "base", "") == "already_exists: frame 'hand' exists already");
  CHECK(add("nail", "fist", "") == "unknown_parent: no frame 'fist' to be the parent of 'nail'");
  CHECK(add("nail", "fist", "arms").rfind("unknown_parent", 0) == 0);
  CHECK(add("nail", "hand", "wings") == "unknown_partition: no partition 'wings'");
  CHECK(add("", "hand", "").rfind("invalid_input: id", 0) == 0);
  known.lose("legs");
  CHECK(add("toe", "foot", "") == std::string("unreachable: ") + kLegsLost);
  CHECK(add("toe", "hand", "legs") == std::string("unreachable: ") + kLegsLost);
  CHECK(add("toe", "foot", "arms") == "ok: ok");
}

// ---- remove

TEST_CASE("a removal tells each owner which subtrees to remove and starts with the frame's owner") {
  const Known known;
  const auto all = route_remove(known.forest, known.directory, "base");
  REQUIRE(all);
  REQUIRE(all->size() == 3);
  CHECK(text((*all)[0]) == "robot[base]: remove base");
  for (const Part& part : *all) {
    if (part.partition == "arms") CHECK(text(part) == "arms[arm]: remove arm gem");
    // Its two subtrees may come in any order.
    if (part.partition == "legs") {
      const auto tops = std::get<RemoveRequest>(part.request.body).tops;
      CHECK(testing::sorted(tops) == Lines{"leg", "ring"});
      CHECK(part.request.id == tops.front());
    }
  }
  const auto leaf = route_remove(known.forest, known.directory, "foot");
  REQUIRE(leaf);
  CHECK(texts(*leaf) == Lines{"legs[foot]: remove foot"});
}

TEST_CASE("a removal is rejected if the frame is unknown or its owner unreachable") {
  Known known;
  const auto unknown = route_remove(known.forest, known.directory, "nobody");
  CHECK(outcome(unknown) == "unknown_frame");
  CHECK(message_of(unknown) == "no frame 'nobody'");
  known.lose("legs");
  CHECK(message_of(route_remove(known.forest, known.directory, "foot")) == kLegsLost);
  // The lost owner of frames below learns of the removal when it returns.
  const auto rest = route_remove(known.forest, known.directory, "hand");
  REQUIRE(rest);
  CHECK(std::none_of(rest->begin(), rest->end(),
                     [](const Part& part) { return part.partition == "legs"; }));
  CHECK(outcome(route_remove(known.forest, known.directory, "gem")) == "ok");
  // The frame below may have been moved away.
  known.directory.note_announced_epoch(*known.directory.owner("legs"), 5);
  CHECK(message_of(route_remove(known.forest, known.directory, "hand")) ==
        kLegsLost +
            std::string(", but its last change has not arrived here: which frames are below "
                        "'hand' is not certain"));
  CHECK(outcome(route_remove(known.forest, known.directory, "gem")) == "ok");
  known.directory.note_announced_epoch(*known.directory.owner("arms"), 5);
  CHECK(outcome(route_remove(known.forest, known.directory, "gem")) == "timeout");
}

// ---- update

TEST_CASE("an update is split by owners") {
  const Known known("arms");
  const auto parts = route_update(
      known.forest, known.directory,
      {{"foot", along_x(1)}, {"hand", along_x(2)}, {"ring", along_x(3)}, {"gem", along_x(4)}});
  REQUIRE(parts);
  CHECK(texts(*parts) == Lines{"legs[foot]: update foot ring", "arms[hand]: update hand gem"});
  CHECK((*parts)[1].owner == kHeldHere);
  const auto& edges = std::get<UpdateRequest>((*parts)[0].request.body).edges;
  CHECK(edges[1].X_PC.pose.translation().x() == 3);
}

TEST_CASE("an update is rejected if a frame is unknown or its owner unreachable") {
  Known known;
  const auto update = [&](const std::string& a, const std::string& b) {
    return message_of(route_update(known.forest, known.directory, {{a, {}}, {b, {}}}));
  };
  CHECK(update("hand", "nobody") == "no frame 'nobody'");
  known.lose("legs");
  CHECK(update("hand", "foot") == kLegsLost);
  CHECK(update("hand", "arm") == "ok");
}

TEST_CASE("the number of edges of one request is limited except in the own process") {
  const Known known("arms");
  std::vector<EdgeUpdate> edges(kMaxItems, EdgeUpdate{"foot", {}});
  CHECK(outcome(route_update(known.forest, known.directory, edges)) == "ok");
  edges.push_back({"foot", {}});
  const auto too_many = route_update(known.forest, known.directory, edges);
  CHECK(outcome(too_many) == "invalid_input");
  CHECK(message_of(too_many) ==
        "partition 'legs' is asked for 4097 edges at once, of at most 4096");
  for (EdgeUpdate& edge : edges) edge.id = "hand";
  CHECK(outcome(route_update(known.forest, known.directory, edges)) == "ok");
}

// ---- move

TEST_CASE("a move goes to the frame's owner") {
  const Known known;
  const auto part =
      route_move(known.forest, known.directory, "ring", MoveRequest{"foot", along_x(1)});
  REQUIRE(part);
  CHECK(text(*part) == "legs[ring]: move below foot with value");
  const auto root = route_move(known.forest, known.directory, "arm", MoveRequest{"", {}});
  REQUIRE(root);
  CHECK(text(*root) == "arms[arm]: move below ");
}

TEST_CASE("a move that cannot succeed is not sent") {
  Known known;
  const auto move = [&](const std::string& id, const std::string& parent) {
    const auto part = route_move(known.forest, known.directory, id, MoveRequest{parent, {}});
    return outcome(part) + ": " + message_of(part);
  };
  CHECK(move("nobody", "base") == "unknown_frame: no frame 'nobody'");
  CHECK(move("hand", "fist") == "unknown_parent: no frame 'fist' to be the parent of 'hand'");
  CHECK(move("arm", "gem") ==
        "cycle: frame 'arm' cannot be moved under 'gem', which lies below it");
  CHECK(move("arm", "arm") == "cycle: frame 'arm' cannot be its own parent");
  known.lose("legs");
  CHECK(move("foot", "hand") == std::string("unreachable: ") + kLegsLost);
  CHECK(move("hand", "foot") == "ok: ok");
}

// ---- lookup

TEST_CASE("a lookup asks each owner on the path once for all its segments") {
  const Known known;
  const auto plan = route_lookup(known.forest, known.directory, "foot", "gem");
  REQUIRE(plan);
  REQUIRE(plan->segments.size() == 4);
  CHECK(texts(plan->parts) ==
        Lines{"legs[foot]: lookup foot>base hand>ring", "arms[hand]: lookup base>hand ring>gem"});
}

TEST_CASE("a part is addressed by a frame that its owner owns") {
  const Known known;
  const auto plan = route_lookup(known.forest, known.directory, "gem", "world");
  REQUIRE(plan);
  CHECK(texts(plan->parts) == Lines{"arms[gem]: lookup gem>ring hand>base",
                                    "legs[ring]: lookup ring>hand",
                                    "robot[base]: lookup base>world"});
  for (const Part& part : plan->parts) {
    CHECK(known.forest.info(part.request.id)->owner == part.owner);
  }
}

TEST_CASE("a lookup from a frame to itself asks no owner") {
  const Known known;
  const auto plan = route_lookup(known.forest, known.directory, "gem", "gem");
  REQUIRE(plan);
  CHECK(plan->segments.empty());
  CHECK(plan->parts.empty());
  const auto X = assemble(*plan, {});
  REQUIRE(X);
  CHECK(X->pose.translation().norm() == 0);
}

TEST_CASE("a lookup that cannot succeed is not sent") {
  Known known;
  const auto lookup = [&](const std::string& a, const std::string& b) {
    return outcome(route_lookup(known.forest, known.directory, a, b));
  };
  CHECK(lookup("nobody", "hand") == "unknown_start");
  CHECK(lookup("hand", "nobody") == "unknown_end");
  CHECK(lookup("hand", "island") == "not_connected");
  known.lose("legs");
  CHECK(lookup("world", "foot") == "unreachable");
  CHECK(message_of(route_lookup(known.forest, known.directory, "arm", "gem")) == kLegsLost);
  CHECK(lookup("world", "hand") == "ok");
}

SegmentValues values(std::vector<Transform> transforms) {
  return {{std::move(transforms)}, std::nullopt, {}, {}};
}

TEST_CASE("answers are assembled in the order of the path") {
  const Known known;
  const auto plan = route_lookup(known.forest, known.directory, "foot", "gem");
  REQUIRE(plan);
  // A quarter turn about z that is not the first makes the order matter.
  Transform turn;
  turn.pose = exp((Twist() << 0, 0, 0, 0, 0, 1.5707963267948966).finished());
  const auto X = assemble(*plan, {values({along_x(1), along_x(10)}), values({turn, along_x(100)})});
  REQUIRE(X);
  CHECK((X->pose.translation() - Eigen::Vector3d(1, 110, 0)).norm() < 1e-9);
}

TEST_CASE("answers with too few or too many transforms are rejected") {
  const Known known;
  const auto plan = route_lookup(known.forest, known.directory, "foot", "gem");
  REQUIRE(plan);
  const SegmentValues two = values(std::vector<Transform>(2));
  const SegmentValues one = values(std::vector<Transform>(1));
  const SegmentValues three = values(std::vector<Transform>(3));
  CHECK(outcome(assemble(*plan, {two, two})) == "ok");
  CHECK(outcome(assemble(*plan, {one, two})) == "not_owner");
  CHECK(outcome(assemble(*plan, {two, {}})) == "not_owner");
  CHECK(outcome(assemble(*plan, {two})) == "not_owner");
  CHECK(outcome(assemble(*plan, {})) == "not_owner");
  CHECK(outcome(assemble(*plan, {two, three})) == "not_owner");
  CHECK(outcome(assemble(*plan, {two, two, one})) == "not_owner");
  CHECK(message_of(assemble(*plan, {two, one})).find("'arms'") != std::string::npos);
}

}  // namespace
}  // namespace tfdude
