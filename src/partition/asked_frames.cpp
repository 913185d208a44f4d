#include "partition/asked_frames.hpp"

#include <algorithm>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {

bool AskedFrames::knows(const std::string& id, Steady since) const {
  const auto known = as_of_.find(id);
  return known != as_of_.end() && known->second >= since;
}

std::vector<std::string> AskedFrames::lacking(const std::vector<std::string>& ids,
                                              Steady since) const {
  std::vector<std::string> lacking;
  std::unordered_set<std::string_view> seen;
  for (const std::string& id : ids) {
    // No frame has an invalid id.
    if (!seen.insert(id).second || !check_id(id, "id")) continue;
    if (!knows(id, since)) lacking.push_back(id);
  }
  return lacking;
}

FramesRequest AskedFrames::request(std::vector<std::string> ids,
                                   std::vector<std::string> trees) const {
  return {std::move(ids), std::move(trees), directory_.announced_epochs()};
}

// Each frame comes after its parent, so none gets a parent that is still below it here.
void AskedFrames::take(const FramesRequest& request, const std::vector<KnownFrame>& answer,
                       Steady asked) {
  // Answers come in any order.
  const auto is_newer_here = [&](const std::string& id) {
    const auto known = as_of_.find(id);
    return known != as_of_.end() && known->second > asked;
  };
  std::unordered_set<std::string_view> there;
  for (const KnownFrame& frame : answer) {
    const bool lacks_parent = !frame.parent.empty() && there.count(frame.parent) == 0;
    if (lacks_parent && !is_newer_here(frame.parent)) drop(frame.parent);
    there.insert(frame.id);
    if (is_newer_here(frame.id)) continue;
    (void)forest_.put_remote(frame.id, frame.parent, directory_.refer_to(frame.partition));
    as_of_[frame.id] = asked;
  }
  for (const std::string& id : request.ids) {
    if (there.count(id) == 0 && !is_newer_here(id)) drop(id);
  }
}

void AskedFrames::drop(const std::string& id) {
  as_of_.erase(id);
  if (const auto frame = forest_.info(id)) forest_.drop_remote(id, frame->owner);
}

namespace {

/// Frames, each after its parent and only once.
class Collection {
 public:
  Collection(const Forest& forest, const Directory& directory)
      : forest_(forest), directory_(directory) {}

  /// Adds the frame and all above it, if it exists.
  void add(const std::string& id) {
    std::vector<FrameInfo> above;
    auto frame = forest_.info(id);
    for (; frame && taken_.insert(frame->id).second; frame = forest_.info(frame->parent)) {
      above.push_back(*frame);
    }
    for (auto one = above.rbegin(); one != above.rend(); ++one) {
      known_.push_back({std::move(one->id), std::move(one->parent), directory_.name(one->owner)});
    }
  }

  /// Looks at each frame once, however many trees overlap.
  void add_tree(const std::string& tree) {
    if (whole_.count(tree) != 0) return;
    for (const FrameInfo& frame : forest_.subtree(tree)) {
      if (is_full()) return;
      whole_.insert(frame.id);
      add(frame.id);
    }
  }

  void add_named(const std::vector<std::string_view>& prefixes) {
    const auto begins = [](const std::string& id) {
      return [&id](std::string_view prefix) { return id.compare(0, prefix.size(), prefix) == 0; };
    };
    for (const FrameInfo& frame : forest_.frames()) {
      if (is_full()) return;
      if (std::any_of(prefixes.begin(), prefixes.end(), begins(frame.id))) add(frame.id);
    }
  }

  /// More do not fit an answer.
  [[nodiscard]] bool is_full() const { return known_.size() > kMaxItems; }
  [[nodiscard]] std::vector<KnownFrame>& known() { return known_; }

 private:
  const Forest& forest_;
  const Directory& directory_;
  std::vector<KnownFrame> known_;
  std::unordered_set<std::string> taken_;
  std::unordered_set<std::string> whole_;  // with all below them
};

// Each of them is compared with all frames.
constexpr std::size_t kMaxPatterns = 64;

// Stops as soon as there are too many.
Result<void> collect(const FramesRequest& request, Collection& found) {
  std::vector<std::string_view> prefixes;
  for (const std::string& tree : request.trees) {
    if (tree.back() == kAnyName) prefixes.emplace_back(tree.data(), tree.size() - 1);
  }
  if (prefixes.size() > kMaxPatterns) {
    return fail(Errc::kTooMuch, std::to_string(prefixes.size()) +
                                    " patterns of names, of at most " +
                                    std::to_string(kMaxPatterns));
  }
  for (const std::string& id : request.ids) {
    if (!found.is_full()) found.add(id);
  }
  for (const std::string& tree : request.trees) {
    if (tree.back() != kAnyName && !found.is_full()) found.add_tree(tree);
  }
  if (!prefixes.empty()) found.add_named(prefixes);
  if (!found.is_full()) return {};
  return fail(Errc::kTooMuch, "the requested trees have more than " + std::to_string(kMaxItems) +
                                  " frames, with those above them");
}

}  // namespace

void merge(std::vector<KnownFrame>& answer, std::vector<KnownFrame>&& other) {
  std::unordered_set<std::string> there;
  for (const KnownFrame& frame : answer) there.insert(frame.id);
  for (KnownFrame& frame : other) {
    if (there.insert(frame.id).second) answer.push_back(std::move(frame));
  }
}

Result<std::vector<KnownFrame>> known_frames(const Forest& forest, const Directory& directory,
                                             const FramesRequest& request) {
  for (const SeenEpoch& seen : request.seen) {
    const auto owner = directory.owner(seen.partition);
    const bool comes = !owner || (*owner != kHeldHere && directory.reachable(*owner) &&
                                  directory.epoch(*owner) < seen.epoch);
    if (!comes) continue;
    return fail(Errc::kNotYet, "the last change of partition " + quote(seen.partition) +
                                   " has not arrived at partition " +
                                   quote(directory.name(kHeldHere)) + " yet");
  }
  Collection found(forest, directory);
  if (auto ok = collect(request, found); !ok) return tl::unexpected(std::move(ok.error()));
  return std::move(found.known());
}

}  // namespace tfdude
