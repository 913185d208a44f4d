#include "importing.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/math/belief.hpp"

namespace tfdude::cli {
namespace {

constexpr std::size_t kAtOnce = 4096;  // what an owner accepts

// Calls a function with parts of a list that an owner accepts, until one fails.
template <class Item, class Function>
Result<void> in_parts(const std::vector<Item>& all, Function&& call) {
  for (std::size_t first = 0; first < all.size(); first += kAtOnce) {
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
    const auto size = static_cast<std::ptrdiff_t>(std::min(kAtOnce, all.size() - first));
    if (auto done = call(std::vector<Item>(begin, begin + size)); !done) return done;
  }
  return {};
}

// Whether the owner may have done what failed here.
bool may_be_done(const Result<void>& done) {
  return done || done.error().code == Errc::kTimeout || done.error().code == Errc::kUnreachable;
}

// What an edge says of its correlation now. Errors left by observations end with its next value.
bool is_correlated(const Basis& basis) {
  const auto is_said = [](const std::string& source) {
    return source.rfind(kObservedPrefix, 0) != 0;
  };
  return basis.bound || std::any_of(basis.sources.begin(), basis.sources.end(), is_said);
}

class Import {
 public:
  Import(Client& client, const std::string& partition, const std::vector<FrameSpec>& frames)
      : client_(client), partition_(partition), frames_(frames) {}

  [[nodiscard]] Result<void> run() {
    if (auto ok = plan(); !ok) return ok;
    auto done = add();
    if (done) done = withdraw();
    if (done) done = correlate();
    if (done) done = set_values();
    if (done) return done;
    if (!has_changed_) undo();
    Error why = std::move(done.error());
    std::string stay;
    for (const std::string& id : open_) stay += (stay.empty() ? "" : ", ") + quote(id);
    why.message += stay.empty() ? "" : "; without a covariance until a next import stay: " + stay;
    return tl::unexpected(std::move(why));
  }

 private:
  // All that can be known to fail is found here.
  [[nodiscard]] Result<void> plan() {
    auto all = client_.frames();
    if (!all) return tl::unexpected(std::move(all.error()));
    for (Frame& frame : *all) known_[frame.id] = std::move(frame);
    if (auto ok = check_structure(); !ok) return ok;
    std::vector<const FrameSpec*> kept;
    for (const FrameSpec& frame : frames_) {
      const auto found = known_.find(frame.id);
      if (found == known_.end()) continue;
      (found->second.parent == frame.parent ? kept : moved_).push_back(&frame);
    }
    // From the top down, so that no frame is moved below itself on the way.
    std::stable_sort(moved_.begin(), moved_.end(), [this](const auto* one, const auto* other) {
      return depths_[one->id] < depths_[other->id];
    });
    return find_correlated(kept);
  }

  // Frames of other partitions stay theirs, and no frame may come below itself.
  [[nodiscard]] Result<void> check_structure() {
    std::map<std::string, std::string> parents;
    for (const auto& [id, frame] : known_) parents[id] = frame.parent;
    for (const FrameSpec& frame : frames_) {
      parents[frame.id] = frame.parent;
      const auto found = known_.find(frame.id);
      if (found == known_.end() || found->second.partition == partition_) continue;
      return fail(Errc::kAlreadyExists, "frame " + quote(frame.id) + " belongs to partition " +
                                            quote(found->second.partition));
    }
    for (const FrameSpec& frame : frames_) {
      if (find_depth(frame.id, parents)) continue;
      return fail(Errc::kCycle, "frame " + quote(frame.id) + ": its new parent " +
                                    quote(frame.parent) + " lies below it");
    }
    return {};
  }

  // Notes the depths of a frame and those above it, up to one whose depth is known: 0 means that it
  // is being sought. @return whether there is no cycle
  [[nodiscard]] bool find_depth(const std::string& id,
                                const std::map<std::string, std::string>& parents) {
    std::vector<std::size_t*> path;
    std::size_t depth = 0;
    for (auto at = parents.find(id); at != parents.end(); at = parents.find(at->second)) {
      const auto [found, is_new] = depths_.try_emplace(at->first, 0);
      depth = found->second;
      if (!is_new && depth == 0) return false;
      if (!is_new) break;
      path.push_back(&found->second);
    }
    for (auto one = path.rbegin(); one != path.rend(); ++one) **one = ++depth;
    return true;
  }

  // Which edges that keep their parent have other error sources before or after. Those of an edge
  // count for all its samples, so they cannot change while it has some.
  [[nodiscard]] Result<void> find_correlated(const std::vector<const FrameSpec*>& kept) {
    std::vector<FramePair> pairs;
    for (const FrameSpec* frame : kept) pairs.push_back({frame->parent, frame->id});
    std::vector<Result<StampedTransform>> found;
    (void)in_parts(pairs, [&](const std::vector<FramePair>& part) {
      for (auto& one : client_.lookup_many(part)) found.push_back(std::move(one));
      return Result<void>();
    });
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const FrameSpec& frame = *kept[i];
      // Edges of one lookup need an instant in common.
      if (!found[i]) found[i] = client_.lookup(frame.parent, frame.id, Query());
      const bool was = !found[i] || is_correlated(found[i]->basis);
      if (!was && frame.correlation.empty()) continue;
      const auto histories = client_.history(frame.id);
      if (!histories) return tl::unexpected(histories.error());
      for (const HistoryInfo& history : *histories) {
        if (history.samples == 0) continue;
        return fail(Errc::kInvalidInput, "frame " + quote(frame.id) +
                                             " has samples, whose error sources would change: " +
                                             "end its history by moving it to its parent " +
                                             quote(frame.parent));
      }
      correlated_.push_back(&frame);
    }
    return check_joints();
  }

  // Joints that follow each other set the correlation themselves.
  [[nodiscard]] Result<void> check_joints() const {
    if (correlated_.empty()) return {};
    const auto joints = client_.joints(partition_);
    if (!joints) return tl::unexpected(joints.error());
    for (const JointInfo& joint : *joints) {
      const bool concerned = std::any_of(correlated_.begin(), correlated_.end(),
                                         [&](const auto* one) { return one->id == joint.frame; });
      const bool leads = std::any_of(joints->begin(), joints->end(), [&](const JointInfo& other) {
        return other.mimic && other.mimic->joint == joint.name;
      });
      if (!concerned || !(joint.mimic || leads)) continue;
      return fail(Errc::kInvalidInput, "frame " + quote(joint.frame) + " is moved by joint " +
                                           quote(joint.name) +
                                           ", which shares its error with others");
    }
    return {};
  }

  [[nodiscard]] Result<void> add() {
    std::set<std::string> there;
    for (const auto& [id, frame] : known_) there.insert(id);
    for (const FrameSpec& frame : frames_) {
      Result<void> done;
      if (there.insert(frame.parent).second) done = add(frame.parent, "", Transform::exact({}));
      if (done && there.insert(frame.id).second) {
        done = add(frame.id, frame.parent, {frame.X_PC.pose, {}});
        open_.insert(frame.id);
        if (done && !frame.correlation.empty()) {
          done = client_.correlate(frame.id, frame.correlation);
        }
      }
      if (!done) return fail_at("frame " + quote(frame.id), done.error());
    }
    return {};
  }

  [[nodiscard]] Result<void> add(const std::string& id, const std::string& parent,
                                 const Transform& X_PC) {
    auto done = client_.add(id, parent, X_PC, partition_);
    if (may_be_done(done)) added_.push_back(id);
    return done;
  }

  // Takes back what edges claim, before anything else of them changes.
  [[nodiscard]] Result<void> withdraw() {
    std::vector<PartialUpdate> edges;
    for (const FrameSpec* frame : correlated_) {
      edges.push_back({frame->id, {std::nullopt, std::nullopt, StatedCovariance()}});
    }
    auto done = in_parts(edges, [this](const std::vector<PartialUpdate>& part) {
      auto changed = client_.update_partial(part);
      if (may_be_done(changed)) {
        for (const PartialUpdate& edge : part) withdrawn(edge.id);
      }
      return changed;
    });
    for (const FrameSpec* frame : moved_) {
      if (!done) return done;
      done = client_.move(frame->id, frame->parent, Transform{frame->X_PC.pose, {}});
      if (may_be_done(done)) withdrawn(frame->id);
      if (!done) done = fail_at("frame " + quote(frame->id), done.error());
    }
    return done;
  }

  void withdrawn(const std::string& id) {
    has_changed_ = true;
    open_.insert(id);
  }

  [[nodiscard]] Result<void> correlate() {
    std::vector<const FrameSpec*> all = correlated_;
    all.insert(all.end(), moved_.begin(), moved_.end());
    for (const FrameSpec* frame : all) {
      if (auto done = client_.correlate(frame->id, frame->correlation); !done) {
        return fail_at("frame " + quote(frame->id), done.error());
      }
    }
    return {};
  }

  [[nodiscard]] Result<void> set_values() {
    std::vector<EdgeUpdate> values;
    for (const FrameSpec& frame : frames_) values.push_back({frame.id, frame.X_PC});
    return in_parts(values, [this](const std::vector<EdgeUpdate>& part) {
      auto done = client_.update(part);
      has_changed_ = has_changed_ || may_be_done(done);
      if (done) {
        for (const EdgeUpdate& edge : part) open_.erase(edge.id);
      }
      return done;
    });
  }

  // Removes what was added, from the leaves up, but nothing that others have put below.
  void undo() {
    open_.clear();
    for (auto id = added_.rbegin(); id != added_.rend(); ++id) {
      const auto below = client_.children(*id);
      const bool is_gone = below && below->empty() && client_.remove(*id);
      if (!is_gone && client_.exists(*id)) open_.insert(*id);
    }
  }

  Client& client_;
  const std::string& partition_;
  const std::vector<FrameSpec>& frames_;
  std::map<std::string, Frame> known_;  // before
  std::map<std::string, std::size_t> depths_;
  std::vector<const FrameSpec*> moved_;       // they get another parent
  std::vector<const FrameSpec*> correlated_;  // they keep it, and not their correlation
  std::vector<std::string> added_;            // a parent before its children
  std::set<std::string> open_;                // without a covariance
  bool has_changed_ = false;                  // what was there before
};

}  // namespace

Result<void> import_frames(Client& client, const std::string& partition,
                           const std::vector<FrameSpec>& frames) {
  return Import(client, partition, frames).run();
}

}  // namespace tfdude::cli
