#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"
#include "unit/tree/naive_forest.hpp"

namespace tfdude {
namespace {

using testing::describe;
using testing::ids_of;
using testing::NaiveForest;
using testing::NaiveTransform;
using testing::outcome;
using testing::Random;
using testing::sorted;
using Ids = std::vector<std::string>;

constexpr double kTolerance = 1e-9;

std::string joined(const Ids& ids) {
  std::string text;
  for (const std::string& id : ids) text += id + "; ";
  return text;
}

NaiveTransform dense(const Transform& X) {
  return {X.pose.matrix(), X.covariance.of_specified().matrix()};
}

// Covariance relative to the largest metres and radians: each block is judged in its own unit.
bool same_value(const Transform& actual, const NaiveTransform& expected) {
  if (!((actual.pose.matrix() - expected.X).cwiseAbs().maxCoeff() <= kTolerance)) return false;
  Twist scale;
  scale << Eigen::Vector3d::Constant(std::sqrt(expected.sigma.diagonal().head<3>().maxCoeff())),
      Eigen::Vector3d::Constant(std::sqrt(expected.sigma.diagonal().tail<3>().maxCoeff()));
  const Matrix6d bound = kTolerance * scale * scale.transpose();
  return ((actual.covariance.of_specified().matrix() - expected.sigma).cwiseAbs().array() <=
          bound.array())
      .all();
}

/// The forest and the oracle, doing the same. Each step returns what differs, "" if nothing.
class Duel {
 public:
  Duel(Random& random, std::size_t ids) : random_(random), ids_(ids) {}

  std::string step() {
    const std::size_t dice = random_.index(100);
    if (dice < 22) return add();
    if (dice < 34) return put_remote();
    if (dice < 40) return drop_remote();
    if (dice < 46) return remove();
    if (dice < 60) return move();
    if (dice < 68) return update();
    if (dice < 76) return update_batch();
    if (dice < 84) return update_by_handle();
    if (dice < 92) return segments();
    return structure();
  }

  /// A few lookups between any two frames, by id, by handle and as a segment.
  std::string look() {
    for (int i = 0; i < 3; ++i) {
      const std::string a = any_id();
      const std::string b = any_id();
      NaiveTransform expected;
      std::string code = naive_.lookup(a, b, false, expected);
      if (!same(forest_.lookup(a, b), code, expected)) return "lookup " + a + " " + b + ": " + code;
      code = naive_.lookup(a, b, true, expected);
      if (!same(testing::lookup_segment(forest_, a, b), code, expected)) {
        return "lookup_segment " + a + " " + b + ": " + code;
      }
    }
    if (handles_.empty()) return "";
    const Known& a = any_handle();
    const Known& b = any_handle();
    NaiveTransform expected;
    const std::string code = !alive(a)   ? "unknown_start"
                             : !alive(b) ? "unknown_end"
                                         : naive_.lookup(a.id, b.id, false, expected);
    return same(forest_.lookup(a.handle, b.handle), code, expected)
               ? ""
               : "lookup by handle " + a.id + " " + b.id + ": " + code;
  }

  /// All that is known of every frame.
  std::string compare() const {
    Ids actual;
    Ids expected;
    for (const FrameInfo& frame : forest_.frames()) actual.push_back(describe(frame));
    for (const auto& [id, frame] : naive_.frames()) {
      expected.push_back(
          describe(FrameInfo{id, frame.parent, frame.owner, naive_.has(frame.parent)}));
    }
    std::sort(actual.begin(), actual.end());
    std::sort(expected.begin(), expected.end());
    if (actual != expected) return "frames: " + joined(actual) + " but " + joined(expected);
    if (forest_.roots() != naive_.roots()) return "roots: " + joined(forest_.roots());
    return "";
  }

  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::size_t succeeded() const { return succeeded_; }
  [[nodiscard]] std::size_t failed() const { return failed_; }
  [[nodiscard]] std::size_t longest_path() const { return longest_; }

 private:
  struct Known {
    std::string id;
    Handle handle;
    std::uint64_t birth;
  };

  // Mostly good ones, taken or free.
  std::string any_id() {
    const std::size_t dice = random_.index(100);
    if (dice == 0) return "";
    if (dice == 1) return "line\nbreak";
    if (dice == 2) return std::string(256, 'x');
    return "frame " + std::to_string(random_.index(ids_));
  }

  // Mostly a frame that exists, because otherwise few operations would succeed.
  std::string likely_id() {
    if (naive_.frames().empty() || random_.index(8) == 0) return any_id();
    auto frame = naive_.frames().begin();
    std::advance(frame, static_cast<std::ptrdiff_t>(random_.index(naive_.frames().size())));
    return frame->first;
  }

  std::string any_parent() { return random_.index(12) == 0 ? "" : likely_id(); }

  const Known& any_handle() { return handles_[random_.index(handles_.size())]; }

  bool alive(const Known& known) const {
    return naive_.has(known.id) && naive_.frames().at(known.id).birth == known.birth;
  }

  // Keeps some handles for later, also past the end of their frames.
  void remember(const std::string& id) {
    const auto handle = forest_.find(id);
    if (!handle || !naive_.has(id)) return;
    const Known known{id, *handle, naive_.frames().at(id).birth};
    if (handles_.size() < 64) {
      handles_.push_back(known);
    } else {
      handles_[random_.index(handles_.size())] = known;
    }
  }

  std::string verdict(const std::string& actual, const std::string& expected) {
    ++(expected == "ok" ? succeeded_ : failed_);
    return actual == expected ? "" : actual + " instead of " + expected;
  }

  template <class Answer>
  bool same(const Result<Answer>& actual, const std::string& code,
            const NaiveTransform& expected) const {
    return outcome(actual) == code && (!actual || same_value(*actual, expected));
  }

  std::string add() {
    const std::string id = any_id();
    const std::string parent = any_parent();
    const bool may_wait = random_.index(4) == 0;
    const Transform X = random_.transform();
    text_ = "add " + id + " under " + parent + (may_wait ? ", may wait" : "");
    const auto rule = may_wait ? Forest::MissingParent::kAllow : Forest::MissingParent::kRefuse;
    const auto result = forest_.add(id, parent, X, rule);
    const std::string difference =
        verdict(outcome(result), naive_.add(id, parent, dense(X), may_wait));
    remember(id);
    return difference;
  }

  std::string put_remote() {
    const std::string id = any_id();
    const std::string parent = random_.index(4) == 0 ? any_id() : any_parent();
    const auto owner = static_cast<Owner>(random_.index(4));  // 0 is rejected
    text_ = "put_remote " + id + " under " + parent + " by " + std::to_string(owner);
    const std::string difference = verdict(outcome(forest_.put_remote(id, parent, owner)),
                                           naive_.put_remote(id, parent, owner));
    remember(id);
    return difference;
  }

  std::string drop_remote() {
    const std::string id = likely_id();
    const auto owner = static_cast<Owner>(random_.index(4));
    text_ = "drop_remote " + id + " by " + std::to_string(owner);
    forest_.drop_remote(id, owner);
    naive_.drop_remote(id, owner);
    return "";
  }

  std::string remove() {
    const std::string id = likely_id();
    text_ = "remove " + id;
    const auto actual = forest_.remove(id);
    Ids expected;
    const std::string difference = verdict(outcome(actual), naive_.remove(id, expected));
    if (!difference.empty() || !actual) return difference;
    return sorted(*actual) == sorted(expected) ? "" : "removed " + joined(*actual);
  }

  std::string move() {
    const std::string id = likely_id();
    const std::string parent = any_parent();
    const Transform X = random_.transform();
    const NaiveTransform value = dense(X);
    const bool keep = random_.index(2) == 0;
    text_ = "move " + id + " under " + parent + (keep ? "" : ", new value");
    const auto result = forest_.move(id, parent, keep ? PartialTransform() : X);
    return verdict(outcome(result), naive_.move(id, parent, keep ? nullptr : &value));
  }

  std::string update() {
    const std::string id = likely_id();
    const Transform X = random_.transform();
    text_ = "update " + id;
    return verdict(outcome(forest_.update(id, X)), naive_.update({{id, dense(X)}}));
  }

  std::string update_batch() {
    std::vector<EdgeUpdate> edges;
    std::vector<std::pair<std::string, NaiveTransform>> naive_edges;
    text_ = "update of several:";
    for (std::size_t i = random_.index(5); i > 0; --i) {
      edges.push_back({likely_id(), random_.transform()});
      naive_edges.emplace_back(edges.back().id, dense(edges.back().X_PC));
      text_ += " " + edges.back().id;
    }
    return verdict(outcome(forest_.update(edges)), naive_.update(naive_edges));
  }

  std::string update_by_handle() {
    if (handles_.empty()) return "";
    const Known& known = any_handle();
    const Transform X = random_.transform();
    text_ = "update by handle of " + known.id;
    const std::string expected =
        alive(known) ? naive_.update({{known.id, dense(X)}}) : "unknown_frame";
    return verdict(outcome(forest_.update(known.handle, X)), expected);
  }

  std::string segments() {
    const std::string a = likely_id();
    const std::string b = likely_id();
    text_ = "segments " + a + " " + b;
    const auto actual = forest_.segments(a, b);
    Ids expected;
    const std::string difference = verdict(outcome(actual), naive_.segments(a, b, expected));
    if (!difference.empty() || !actual) return difference;
    Ids texts;
    for (const Segment& run : *actual) {
      texts.push_back(run.from + " > " + run.to + " @" + std::to_string(run.owner));
    }
    longest_ = std::max(longest_, texts.size());
    return texts == expected ? "" : joined(texts) + " instead of " + joined(expected);
  }

  std::string structure() {
    const std::string id = likely_id();
    text_ = "children, subtree, holds and value of " + id;
    const bool there = naive_.has(id);
    const bool held = there && naive_.frames().at(id).owner == kHeldHere;
    const auto children = forest_.children(id);
    if (outcome(children) != (there ? "ok" : "unknown_frame")) return outcome(children);
    if (there && *children != naive_.children(id)) return joined(*children);
    const Ids below = ids_of(forest_.subtree(id));
    if (sorted(below) != naive_.subtree(id)) return joined(below);
    for (auto child = below.begin(); child != below.end(); ++child) {
      const std::string& parent = naive_.frames().at(*child).parent;
      if (*child != id && std::find(below.begin(), child, parent) == child) return joined(below);
    }
    if (forest_.exists(id) != there || forest_.holds(id) != held) return "exists or holds";
    const auto value = forest_.value(id);
    if (held) return value && same_value(*value, naive_.frames().at(id).value) ? "" : "value";
    return verdict(outcome(value), there ? "not_owner" : "unknown_frame");
  }

  Random& random_;
  std::size_t ids_;
  Forest forest_;
  NaiveForest naive_;
  std::vector<Known> handles_;
  std::string text_;
  std::size_t succeeded_ = 0;
  std::size_t failed_ = 0;
  std::size_t longest_ = 0;
};

TEST_CASE("any sequence of operations has the result of the naive forest") {
  constexpr int kSteps = 6000;
  // Few ids collide and wait for each other all the time; many grow deep trees and the tables.
  const std::size_t ids = GENERATE(8U, 40U, 150U);
  Random random(0x7f0de + ids);
  Duel duel(random, ids);
  for (int i = 0; i < kSteps; ++i) {
    const std::string stepped = duel.step();
    INFO("seed " << random.seed() << ", " << ids << " ids, step " << i << ": " << duel.text());
    REQUIRE(stepped == "");
    REQUIRE(duel.look() == "");
    REQUIRE(duel.compare() == "");
  }
  // Both sides of the contract were tried, on paths of some length.
  CHECK(duel.succeeded() > kSteps / 8);
  CHECK(duel.failed() > kSteps / 20);
  CHECK(duel.longest_path() >= 3);
}

}  // namespace
}  // namespace tfdude
