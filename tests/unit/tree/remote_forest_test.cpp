// Lookups in the memory of other owners, compared with those of one forest that holds all edges.

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/shared_forest.hpp"
#include "tree/forest.hpp"
#include "tree/remote_edges.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::outcome;
using testing::Random;
using testing::SharedForest;
using testing::transform_diff;
using testing::x_of;

constexpr Owner kOwners = 3;
constexpr std::int64_t kMs = 1'000'000;

Time at_ms(std::int64_t ms) { return time_of(ms * kMs); }

// Looks up as a client does: binds the path if it is not bound.
template <class Look>
auto read(const Forest& forest, RemoteEdges& others, const std::string& a, const std::string& b,
          Look look) {
  auto found = look();
  if (!found && found.error().code == Errc::kNotOwner && forest.bind(a, b, others) > 0) {
    found = look();
  }
  return found;
}

// A reader that owns some frames, the owners of all others, and an oracle that holds all of them.
class World {
 public:
  explicit World(Random& random) : random_(random) {
    for (Owner owner = 1; owner <= kOwners; ++owner) {
      owners_.push_back(std::make_unique<SharedForest>());
      others_.attach(owner, owners_.back()->seen(), nullptr);
    }
    add("world", "", 0);
  }

  void step() {
    const std::size_t dice = random_.index(100);
    const std::string id = any_id();
    if (dice < 15) {
      add("f" + std::to_string(made_++), id, static_cast<Owner>(random_.index(kOwners + 1)));
    } else if (dice < 20) {
      remove(id);
    } else if (dice < 27) {
      move(id, any_id());
    } else if (dice < 32) {
      set_timing(id);
    } else if (dice < 36) {
      correlate(id);
    } else if (dice < 44) {
      revise(id);
    } else if (dice < 49) {
      each_of(id, [&](Forest& forest) { return forest.clear_history(id); });
    } else {
      update(id);
    }
  }

  /// What differs, or cannot be read although it could; "" if nothing.
  std::string look() {
    const std::string a = any_id();
    const std::string b = any_id();
    Query query;
    if (random_.index(3) > 0)
      query.at = at_ms(now_ - 40 + static_cast<std::int64_t>(random_.index(60)));
    if (random_.index(3) == 0) query.extrapolate = std::chrono::milliseconds(random_.index(40));
    if (random_.index(4) == 0) query.age_noise_until = at_ms(now_ + 50);
    if (random_.index(5) == 0) query.order = Order::kFourth;
    const std::string what = a + " " + b + ": ";
    const auto newest =
        read(reader_, others_, a, b, [&] { return reader_.lookup(a, b, {}, others_); });
    const auto expected_newest = oracle_.lookup(a, b);
    if (auto wrong = differs(newest, expected_newest); !wrong.empty()) return what + wrong;
    if (newest && newest->stamp != expected_newest->stamp) return what + "another newest stamp";
    if (newest && newest->basis.bound != expected_newest->basis.bound) {
      return what + "another bound of the newest";
    }
    const auto pose =
        read(reader_, others_, a, b, [&] { return reader_.lookup_pose(a, b, others_); });
    const auto expected_pose = oracle_.lookup_pose(a, b);
    if (pose.has_value() && !expected_pose) return what + "a pose where there is none";
    if (pose && !(pose->matrix() == expected_pose->matrix())) return what + "another pose";
    const auto found =
        read(reader_, others_, a, b, [&] { return reader_.lookup(a, b, query, others_); });
    const auto expected = oracle_.lookup(a, b, query);
    if (auto wrong = differs(found, expected); !wrong.empty()) return what + wrong;
    if (found && found->stamp != expected->stamp) return what + "another stamp";
    if (found && found->basis.unspecified != expected->basis.unspecified) {
      return what + "other unspecified edges";
    }
    if (found && found->basis.sources != expected->basis.sources) return what + "other sources";
    if (found && found->basis.bound != expected->basis.bound) return what + "another bound";
    if (auto wrong = look_at_segments(a, b, query); !wrong.empty()) return what + wrong;
    if (auto wrong = look_at_motion(a, b, query); !wrong.empty()) return what + wrong;
    if (found) ++answered_;
    if (found && found->stamp) ++dynamic_;
    if (found && (found->basis.bound || !found->basis.sources.empty())) ++correlated_;
    return "";
  }

  [[nodiscard]] int answered() const { return answered_; }
  [[nodiscard]] int dynamic() const { return dynamic_; }
  [[nodiscard]] int correlated() const { return correlated_; }
  [[nodiscard]] int segments() const { return segments_; }
  [[nodiscard]] int moving() const { return moving_; }

 private:
  struct Frame {
    std::string id;
    std::string parent;
    Owner owner;
  };

  // The forest of an owner; 0 is the reader.
  Forest& of(Owner owner) { return owner == 0 ? reader_ : owners_[owner - 1]->forest; }
  // How the forest of one calls the other.
  static Owner called(Owner whose, Owner other) {
    return whose == other ? kHeldHere : other == 0 ? 9 : other;
  }

  Frame* frame(const std::string& id) {
    for (Frame& one : frames_) {
      if (one.id == id) return &one;
    }
    return nullptr;
  }
  std::string any_id() { return frames_[random_.index(frames_.size())].id; }

  // Of the oracle, and of the owner.
  template <class Change>
  bool each_of(const std::string& id, Change change) {
    Frame* found = frame(id);
    if (found == nullptr) return false;
    const auto expected = change(oracle_);
    const auto done = change(of(found->owner));
    REQUIRE(outcome(done) == outcome(expected));
    return done.has_value();
  }

  Transform value() {
    Transform X = random_.transform();
    const std::size_t kind = random_.index(6);
    if (kind == 0) X.covariance = StatedCovariance::unspecified();
    if (kind == 1) X.covariance = StatedCovariance::exact();
    return X;
  }

  void tell(const Frame& one) {
    for (Owner whose = 0; whose <= kOwners; ++whose) {
      if (whose != one.owner)
        REQUIRE(of(whose).put_remote(one.id, one.parent, called(whose, one.owner)));
    }
  }

  void add(const std::string& id, const std::string& parent, Owner owner) {
    const Transform X = value();
    REQUIRE(oracle_.add(id, parent, X));
    REQUIRE(of(owner).add(id, parent, X));
    frames_.push_back({id, parent, owner});
    tell(frames_.back());
  }

  // Of a leaf, so that no frame waits for it.
  void remove(const std::string& id) {
    const Frame* found = frame(id);
    const bool leaf = std::none_of(frames_.begin(), frames_.end(),
                                   [&](const Frame& one) { return one.parent == id; });
    if (!leaf || frames_.size() < 5) return;
    REQUIRE(oracle_.remove(id));
    REQUIRE(of(found->owner).remove(id));
    for (Owner whose = 0; whose <= kOwners; ++whose) {
      if (whose != found->owner) of(whose).drop_remote(id, called(whose, found->owner));
    }
    frames_.erase(frames_.begin() + (found - frames_.data()));
  }

  void move(const std::string& id, const std::string& parent) {
    if (frame(id)->parent.empty() || !oracle_.move(id, parent)) return;
    Frame& moved = *frame(id);
    moved.parent = parent;
    REQUIRE(of(moved.owner).move(id, parent));
    tell(moved);
  }

  void set_timing(const std::string& id) {
    EdgeTiming timing;
    timing.count = 2 + random_.index(60);
    timing.span = std::chrono::milliseconds(20 + random_.index(200));
    timing.moving = random_.index(2) == 0;
    if (random_.index(2) == 0) {
      timing.process_noise = random_.covariance();
      timing.drifts = random_.index(2) == 0;
    }
    each_of(id, [&](Forest& forest) { return forest.set_timing(id, timing); });
  }

  Correlation correlation(const std::string& prefix) {
    Correlation correlation;
    if (random_.index(3) == 0) return correlation;
    correlation.unknown = random_.index(4) == 0;
    for (int i = 0; i < 4; ++i) {
      if (random_.index(2) == 0) continue;
      const auto columns = static_cast<Eigen::Index>(1 + random_.index(4));
      correlation.common_errors.push_back(
          {prefix + std::to_string(i), false, random_.loading(columns, 0.003)});
    }
    return correlation;
  }

  void correlate(const std::string& id) {
    const Correlation said = correlation("source ");
    each_of(id, [&](Forest& forest) { return forest.correlate(id, said); });
  }

  // As an observation does.
  void revise(const std::string& id) {
    if (frame(id)->parent.empty()) return;
    Revision revision{id, random_.transform(), correlation(std::string(kObservedPrefix))};
    if (random_.index(3) > 0) revision.correlation.observed_with = {any_id()};
    if (random_.index(3) == 0 && !revision.correlation.common_errors.empty()) {
      CommonError removed = revision.correlation.common_errors.front();
      removed.subtracts = true;
      removed.loading *= 0.1;
      revision.correlation.common_errors.push_back(removed);
    }
    const Time at = at_ms(now_ - static_cast<std::int64_t>(random_.index(30)));
    each_of(id, [&](Forest& forest) {
      const bool moving = forest.kept(id)->time.stamp.has_value();
      return forest.revise({revision}, moving ? std::optional<Time>(at) : std::nullopt, UINT64_MAX);
    });
  }

  void update(const std::string& id) {
    if (frame(id)->parent.empty()) return;
    const std::size_t kind = random_.index(10);
    const Transform X = value();
    if (kind < 2) {
      each_of(id, [&](Forest& forest) { return forest.update(id, X); });
      return;
    }
    if (kind < 8) now_ += static_cast<std::int64_t>(random_.index(4));
    const std::int64_t late = kind < 8 ? 0 : static_cast<std::int64_t>(random_.index(40));
    if (random_.index(4) > 0) {
      each_of(id, [&](Forest& forest) { return forest.update(id, X, at_ms(now_ - late)); });
      return;
    }
    const JointState state{&joint_, {random_.uniform(-3, 3), 1e-4}, 0};
    const Transform moved = joint_transform(joint_, state.at.position, state.at.variance);
    each_of(id, [&](Forest& forest) {
      return forest.update_correlated({{*forest.find(id), moved, nullptr, state}},
                                      at_ms(now_ - late));
    });
  }

  // As an owner is asked for the segments that it has of a path.
  std::string look_at_segments(const std::string& a, const std::string& b, const Query& query) {
    const auto runs = reader_.segments(a, b);
    if (!runs || runs->empty()) return "";
    std::vector<PathEnds> asked;
    for (const Segment& run : *runs) asked.push_back({run.from, run.to});
    std::optional<Time> hint;
    if (random_.index(2) == 0) hint = at_ms(now_ - static_cast<std::int64_t>(random_.index(30)));
    const auto found = reader_.lookup_segments(asked, query, hint, others_);
    const auto expected = oracle_.lookup_segments(asked, query, hint);
    if (found.has_value() != expected.has_value()) return "segments: " + outcome(found);
    if (!found) return "";
    ++segments_;
    if (found->stamp != expected->stamp) return "segments of another stamp";
    const auto at_one = [](const ValuesAtInstant& x, const ValuesAtInstant& y) -> std::string {
      if (x.values.size() != y.values.size()) return "another number of values";
      if (x.correlations.size() != y.correlations.size()) return "other correlations";
      for (std::size_t i = 0; i < x.values.size(); ++i) {
        if (auto wrong = transform_diff(x.values[i], y.values[i], 1e-12); !wrong.empty()) {
          return wrong;
        }
        if (x.correlations.empty()) continue;
        const Belief left = belief_of(x.values[i], x.correlations[i]);
        const Belief right = belief_of(y.values[i], y.correlations[i]);
        const bool same = left.common_errors.size() == right.common_errors.size() &&
                          left.unknown.has_value() == right.unknown.has_value();
        if (!same) return "another correlation";
        if (auto wrong = transform_diff(collapse(left), collapse(right), 1e-12); !wrong.empty()) {
          return wrong;
        }
      }
      const auto same_edge = [](const UnspecifiedEdge& p, const UnspecifiedEdge& q) {
        return p.segment == q.segment && p.id == q.id;
      };
      const bool same = std::equal(x.unspecified.begin(), x.unspecified.end(),
                                   y.unspecified.begin(), y.unspecified.end(), same_edge);
      return same ? "" : "other unspecified edges";
    };
    if (auto wrong = at_one(*found, *expected); !wrong.empty()) return "segments: " + wrong;
    return at_one(found->at_hint, expected->at_hint);
  }

  // As a velocity asks for the single edges of a path.
  std::string look_at_motion(const std::string& a, const std::string& b, const Query& query) {
    const auto edges = reader_.edges(a, b);
    if (!edges || edges->empty()) return "";
    std::vector<PathEnds> asked;
    for (const FrameInfo& edge : *edges) asked.push_back({edge.parent, edge.id});
    const auto found = reader_.lookup_segments(asked, query, {}, others_, true, query.at);
    const auto expected = oracle_.lookup_segments(asked, query, {}, true);
    if (found.has_value() != expected.has_value()) return "motion: " + outcome(found);
    if (!found) return "";
    if (found->correlations.size() != asked.size()) return "motion of some edges only";
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const PathCorrelation& of = found->correlations[i];
      const PathCorrelation& right = expected->correlations[i];
      if (is_moving(asked[i].to, of)) ++moving_;
      const bool same = is_moving(asked[i].to, of) == is_moving(asked[i].to, right) &&
                        is_drifting(asked[i].to, of) == is_drifting(asked[i].to, right);
      if (!same) return "motion of '" + asked[i].to + "'";
    }
    return "";
  }

  template <class Value>
  static std::string differs(const Result<Value>& found, const Result<Value>& expected) {
    if (found && !expected) return "an answer where there is " + outcome(expected);
    if (!found) return expected ? "not read: " + outcome(found) : "";
    return transform_diff(*found, *expected, 1e-12);
  }

  Random& random_;
  Forest oracle_;
  Forest reader_;
  std::vector<std::unique_ptr<SharedForest>> owners_;
  RemoteEdges others_;
  std::vector<Frame> frames_;
  Joint joint_ = [] {
    Joint joint;
    joint.S = Twist::Zero();
    joint.S[5] = 1;
    return joint;
  }();
  std::int64_t now_ = 1000;
  int made_ = 0;
  int answered_ = 0;
  int dynamic_ = 0;
  int correlated_ = 0;
  int segments_ = 0;
  int moving_ = 0;
};

}  // namespace

TEST_CASE("lookups in the memory of others are those of one forest") {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    INFO("seed " << random.seed());
    World world(random);
    for (int i = 0; i < 600; ++i) {
      world.step();
      for (int k = 0; k < 3; ++k) REQUIRE(world.look() == "");
    }
    CHECK(world.answered() > 200);
    CHECK(world.dynamic() > 40);
    CHECK(world.correlated() > 40);
    CHECK(world.segments() > 200);
    CHECK(world.moving() > 100);
  }
}

// An owner of base -> side and base -> tip, and a reader that knows its frames.
struct Branched {
  Branched() {
    REQUIRE(arm.forest.add("base", "", along_x(0)));
    REQUIRE(arm.forest.add("side", "base", along_x(100)));
    REQUIRE(arm.forest.add("tip", "base", along_x(1)));
    others.attach(1, arm.seen(), nullptr);
    REQUIRE(here.put_remote("base", "", 1));
    REQUIRE(here.put_remote("side", "base", 1));
    REQUIRE(here.put_remote("tip", "base", 1));
  }
  SharedForest arm;
  Forest here;
  RemoteEdges others;
};

TEST_CASE("a walk reads as many common errors as one before it") {
  constexpr int kEdges = 30;
  SharedForest arm;
  RemoteEdges others;
  Forest here;
  others.attach(1, arm.seen(), nullptr);
  Correlation said;
  for (int i = 0; i < 10; ++i) {
    said.common_errors.push_back({"s" + std::to_string(i), false, 0.01 * Loading::Ones(6, 1)});
  }
  REQUIRE(arm.forest.add("f0", "", {}));
  REQUIRE(here.put_remote("f0", "", 1));
  for (int i = 1; i <= kEdges; ++i) {
    const std::string id = "f" + std::to_string(i);
    const std::string parent = "f" + std::to_string(i - 1);
    REQUIRE(arm.forest.add(id, parent, along_x(0)));
    REQUIRE(here.put_remote(id, parent, 1));
    REQUIRE(arm.forest.correlate(id, said));
    // Of different stamps, so that a second walk names the sources.
    for (const int ms : {0, 20 + i}) REQUIRE(arm.forest.update(id, along_x(0.1), at_ms(ms)));
  }
  Query query;
  query.at = at_ms(10);
  const std::string last = "f" + std::to_string(kEdges);
  const auto found =
      read(here, others, "f0", last, [&] { return here.lookup("f0", last, query, others); });
  const auto expected = arm.forest.lookup("f0", last, query);
  REQUIRE(expected);
  REQUIRE(found);
  CHECK(expected->basis.bound);
  CHECK(transform_diff(*found, *expected, 1e-12) == "");
}

TEST_CASE("an edge that its owner has moved is not read until that is known here") {
  Branched branched;
  SharedForest& arm = branched.arm;
  Forest& here = branched.here;
  RemoteEdges& others = branched.others;
  const auto look = [&] { return here.lookup("base", "tip", {}, others); };
  CHECK(outcome(look()) == "not_owner");
  REQUIRE(here.bind("base", "tip", others) == 1);
  CHECK(x_of(look()) == 1);
  REQUIRE(arm.forest.update("tip", along_x(2)));
  CHECK(x_of(look()) == 2);

  REQUIRE(arm.forest.move("tip", "side"));
  CHECK(outcome(look()) == "not_owner");
  CHECK(here.bind("base", "tip", others) == 0);
  REQUIRE(here.put_remote("tip", "side", 1));
  CHECK(outcome(look()) == "not_owner");
  REQUIRE(here.bind("base", "tip", others) == 2);
  CHECK(x_of(look()) == 102);

  // Another frame of the same name.
  REQUIRE(arm.forest.remove("tip"));
  REQUIRE(arm.forest.add("tip", "side", along_x(5)));
  CHECK(outcome(look()) == "not_owner");
  REQUIRE(here.bind("base", "tip", others) == 2);
  CHECK(x_of(look()) == 105);

  // Another owner of it.
  here.drop_remote("tip", 1);
  REQUIRE(here.put_remote("tip", "side", 2));
  CHECK(outcome(look()) == "not_owner");
  CHECK(here.bind("base", "tip", others) == 0);
}

TEST_CASE("until it is known here what became of an edge, its last value is there") {
  Branched branched;
  SharedForest& arm = branched.arm;
  Forest& here = branched.here;
  RemoteEdges& others = branched.others;
  REQUIRE(here.bind("base", "tip", others) == 1);
  const auto former = [&] { return here.lookup_former("base", "tip", others); };
  CHECK(x_of(former()) == 1);
  REQUIRE(arm.forest.update("tip", along_x(2)));
  CHECK(x_of(former()) == 2);
  REQUIRE(arm.forest.move("tip", "side"));
  REQUIRE(arm.forest.update("tip", along_x(5)));
  CHECK(outcome(here.lookup("base", "tip", Query{}, others)) == "not_owner");
  CHECK(x_of(former()) == 2);
  // Both edges of the path, as they were when the last one was that of the path.
  REQUIRE(arm.forest.update("side", along_x(200)));
  REQUIRE(arm.forest.move("tip", "base"));
  REQUIRE(arm.forest.update("tip", along_x(7)));
  REQUIRE(here.put_remote("tip", "side", 1));
  CHECK(outcome(former()) == "not_owner");
  CHECK(here.bind("base", "tip", others) == 0);
  REQUIRE(here.bind("base", "tip", others, true) == 2);
  CHECK(outcome(here.lookup("base", "tip", Query{}, others)) == "not_owner");
  CHECK(x_of(former()) == 205);
  REQUIRE(arm.forest.update("side", along_x(300)));
  CHECK(x_of(former()) == 205);
  // That is not kept for ever.
  for (int i = 0; i < 1000; ++i) REQUIRE(arm.forest.update("side", along_x(i)));
  CHECK_FALSE(former());
  CHECK(here.bind("base", "tip", others, true) == 0);
  // Once it is known here, it counts again.
  REQUIRE(here.put_remote("tip", "base", 1));
  REQUIRE(here.bind("base", "tip", others, true) == 1);
  CHECK(x_of(here.lookup("base", "tip", Query{}, others)) == 7);
  CHECK(x_of(former()) == 7);
}

TEST_CASE("what comes next here is not what was before that which was read") {
  Branched branched;
  SharedForest& arm = branched.arm;
  Forest& here = branched.here;
  RemoteEdges& others = branched.others;
  REQUIRE(here.bind("base", "tip", others) == 1);
  REQUIRE(arm.forest.move("tip", "side"));
  REQUIRE(arm.forest.update("tip", along_x(2)));
  // Twice, of which nothing is known here: that it has the same parent is by chance.
  REQUIRE(arm.forest.move("tip", "base"));
  REQUIRE(arm.forest.update("tip", along_x(3)));
  REQUIRE(here.bind("base", "tip", others) == 1);
  CHECK(x_of(here.lookup("base", "tip", Query{}, others)) == 3);
  REQUIRE(here.put_remote("tip", "side", 1));
  CHECK(here.bind("base", "tip", others, true) == 0);
  CHECK(outcome(here.lookup_former("base", "tip", others)) == "not_owner");
  REQUIRE(here.put_remote("tip", "base", 1));
  REQUIRE(here.bind("base", "tip", others) == 1);
  CHECK(x_of(here.lookup("base", "tip", Query{}, others)) == 3);
}

TEST_CASE("what is detached is not read, and its memory is kept while somebody reads it") {
  SharedForest arm;
  REQUIRE(arm.forest.add("base", "", along_x(0)));
  REQUIRE(arm.forest.add("tip", "base", along_x(1)));
  Forest here;
  REQUIRE(here.put_remote("base", "", 1));
  REQUIRE(here.put_remote("tip", "base", 1));
  RemoteEdges others;
  bool released = false;
  const int some = 0;
  others.attach(1, arm.seen(), {&some, [&](const void*) { released = true; }});
  CHECK(others.any());
  REQUIRE(here.bind("base", "tip", others) == 1);
  CHECK(x_of(here.lookup("base", "tip", {}, others)) == 1);
  {
    const epoch::Guard guard;
    others.detach(1);
    CHECK_FALSE(released);
  }
  CHECK_FALSE(others.any());
  CHECK(outcome(here.lookup("base", "tip", {}, others)) == "not_owner");
  others.detach(1);
  CHECK(released);
}

TEST_CASE("a forest outgrows its memory, and what does not fit is not read by others") {
  SharedForest arm(std::size_t{256} << 10U);
  REQUIRE(arm.forest.add("base", "", along_x(0)));
  Forest here;
  RemoteEdges others;
  others.attach(1, arm.seen(), nullptr);
  REQUIRE(here.put_remote("base", "", 1));
  int read_here = 0;
  constexpr int kFrames = 2000;
  for (int i = 1; i <= kFrames; ++i) {
    const std::string id = "f" + std::to_string(i);
    REQUIRE(arm.forest.add(id, "base", along_x(i)));
    REQUIRE(here.put_remote(id, "base", 1));
    CHECK(x_of(arm.forest.lookup("base", id)) == i);
    if (here.bind("base", id, others) == 0) continue;
    ++read_here;
    CHECK(x_of(here.lookup("base", id, {}, others)) == i);
  }
  CHECK(read_here > 100);
  CHECK(read_here < kFrames);
}

TEST_CASE("memory that is not an owner's, or of another layout, is not opened") {
  SharedForest arm;
  CHECK(RemoteForest::open(arm.memory.read(), arm.memory.size()));
  CHECK_FALSE(RemoteForest::open(arm.memory.read(), 64));
  CHECK_FALSE(RemoteForest::open(arm.memory.read(), arm.memory.size() / 2));
  arm.arena->roots().layout += 1;
  const auto other = RemoteForest::open(arm.memory.read(), arm.memory.size());
  REQUIRE_FALSE(other);
  CHECK(other.error().message == "it has another layout: its owner is another build");
  arm.arena->roots().layout -= 1;
  arm.arena->roots().magic += 1;
  CHECK_FALSE(RemoteForest::open(arm.memory.read(), arm.memory.size()));
}

TEST_CASE("correlations that are written again and again take no more memory") {
  Random random(5);
  SharedForest arm;
  REQUIRE(arm.forest.add("base", "", along_x(0)));
  REQUIRE(arm.forest.add("tip", "base", along_x(1)));
  REQUIRE(arm.forest.add("odometry", "base", along_x(1)));
  EdgeTiming drifting;
  drifting.process_noise = random.covariance();
  drifting.drifts = true;
  drifting.count = 50;
  REQUIRE(arm.forest.set_timing("odometry", drifting));
  std::int64_t t = 0;
  const auto write = [&](int times) {
    for (int i = 0; i < times; ++i) {
      const std::vector<CommonError> errors{{"source", false, random.loading(1 + i % 20)}};
      REQUIRE(arm.forest.correlate("tip", {false, errors, {}}));
      REQUIRE(arm.forest.revise({{"tip", random.transform(), {false, errors, {"odometry"}}}},
                                std::nullopt, UINT64_MAX));
      REQUIRE(arm.forest.update("odometry", random.transform(), at_ms(++t)));
      if (i % 10 == 0) {
        REQUIRE(arm.forest.revise({{"odometry", random.transform(), {false, errors, {"tip"}}}},
                                  at_ms(t), UINT64_MAX));
      }
    }
  };
  write(2000);
  const std::size_t used = arm.arena->used();
  write(4000);
  CHECK(arm.arena->used() <= used + used / 10);
}

TEST_CASE("damaged memory does no harm") {
  Random random(7);
  INFO("seed " << random.seed());
  constexpr int kDepth = 12;
  constexpr int kStatic = 7;
  constexpr std::size_t kPage = 4096;
  SharedForest arm(std::size_t{1} << 20U);
  const auto id = [](int i) { return "f" + std::to_string(i); };
  EdgeTiming noisy;
  noisy.process_noise = random.covariance();
  Joint joint;
  joint.S = Twist::Zero();
  joint.S[5] = 1;
  REQUIRE(arm.forest.add(id(0), "", along_x(0)));
  Forest here;
  REQUIRE(here.put_remote(id(0), "", 1));
  for (int i = 1; i <= kDepth; ++i) {
    REQUIRE(arm.forest.add(id(i), id(i - 1), random.transform()));
    REQUIRE(here.put_remote(id(i), id(i - 1), 1));
    if (i % 3 == 0) REQUIRE(arm.forest.set_timing(id(i), noisy));
    for (int n = 0; n < 40 && i != kStatic; ++n) {
      if (i % 4 == 0) {
        const JointState state{&joint, {0.1 * n, 1e-4}, 0};
        const Transform X = joint_transform(joint, state.at.position, state.at.variance);
        REQUIRE(arm.forest.update_correlated({{*arm.forest.find(id(i)), X, nullptr, state}},
                                             at_ms(100 + 10 * n + i)));
      } else {
        REQUIRE(arm.forest.update(id(i), random.transform(), at_ms(100 + 10 * n + i)));
      }
    }
  }
  const auto shared = [&](const std::string& prefix) {
    return std::vector<CommonError>{{prefix + "1", false, random.loading(2)},
                                    {prefix + "2", false, random.loading(36)}};
  };
  REQUIRE(arm.forest.correlate(id(2), {false, shared("source "), {}}));
  REQUIRE(arm.forest.correlate(id(5), {true, shared("source "), {}}));
  const auto observed = [&](int i) {
    return Revision{id(i), random.transform(), {false, shared("observed:"), {id(11)}}};
  };
  REQUIRE(arm.forest.revise({observed(kStatic)}, std::nullopt, UINT64_MAX));
  for (const int i : {8, 10}) {
    REQUIRE(arm.forest.revise({observed(i)}, at_ms(250), UINT64_MAX));
  }
  // Between pages that nobody may touch.
  const std::size_t used = (arm.arena->used() + kPage - 1) / kPage * kPage;
  auto* around = static_cast<char*>(
      mmap(nullptr, used + 2 * kPage, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  char* copy = around + kPage;
  REQUIRE(mprotect(copy, used, PROT_READ | PROT_WRITE) == 0);
  const auto* intact = static_cast<const char*>(arm.memory.read());
  auto* roots = reinterpret_cast<SharedRoots*>(copy);
  std::uint64_t answers = 0;
  std::uint64_t refused = 0;
  const auto damage = [&] {
    const std::size_t places = 1 + random.index(40);
    for (std::size_t k = 0; k < places; ++k) {
      const std::size_t word = random.index(used / 8) * 8;
      std::uint64_t value = 0;
      std::memcpy(&value, copy + word, 8);
      const std::uint64_t base = roots->base;
      switch (random.index(6)) {
        case 0:
          value = random.engine()();
          break;
        case 1:
          value ^= std::uint64_t{1} << random.index(64);
          break;
        case 2:
          value = base + random.index(used + kPage);
          break;
        case 3:
          value = base + random.index(used / 64) * 64;
          break;
        case 4:
          value = ~std::uint64_t{0};
          break;
        default:
          value = 0;
      }
      std::memcpy(copy + word, &value, 8);
    }
  };
  for (int round = 0; round < 3000; ++round) {
    std::memcpy(copy, intact, used);
    roots->size = used;
    RemoteEdges others;
    const bool early = round % 2 == 0;
    const auto opened = RemoteForest::open(copy, used);
    REQUIRE(opened);
    others.attach(1, *opened, nullptr);
    if (early) damage();
    (void)here.bind(id(0), id(kDepth), others);
    if (!early) damage();
    Query query;
    query.at = at_ms(100 + static_cast<std::int64_t>(random.index(450)));
    query.extrapolate = std::chrono::milliseconds(20);
    if (round % 3 == 0) query.order = Order::kFourth;
    const auto newest = here.lookup(id(0), id(kDepth), {}, others);
    const auto then = here.lookup(id(0), id(kDepth), query, others);
    for (const auto& X : {newest, then}) {
      if (!X) {
        ++refused;
        continue;
      }
      ++answers;
      CHECK(check_finite(*X));
    }
  }
  CHECK(answers > 100);
  CHECK(refused > 100);
  munmap(around, used + 2 * kPage);
}

}  // namespace tfdude
