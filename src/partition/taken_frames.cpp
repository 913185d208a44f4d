#include "partition/taken_frames.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

using Ids = std::vector<std::string>;

// The first of them, and how many more there are.
std::string listed(const Ids& ids) {
  constexpr std::size_t kMost = 5;
  std::string text = ids.size() == 1 ? "frame " : "frames ";
  for (std::size_t i = 0; i < std::min(ids.size(), kMost); ++i) {
    text += (i == 0 ? "" : ", ") + quote(ids[i]);
  }
  if (ids.size() > kMost) text += " and " + std::to_string(ids.size() - kMost) + " more";
  return text;
}

// The links that are left, as the entries FROM..TO[..TO] that `links` has. A link above a taken one
// is an end, so that what else is below it needs entries of its own.
std::string links_left(const std::vector<FrameSpec>& frames, const std::set<std::string>& taken) {
  std::map<std::string, Ids> below;
  for (const FrameSpec& frame : frames) below[frame.parent].push_back(frame.id);
  const auto is_end = [&](const std::string& id) {
    const Ids& children = below[id];
    return std::any_of(children.begin(), children.end(),
                       [&](const std::string& child) { return taken.count(child) > 0; });
  };
  std::set<std::string> ids;
  for (const FrameSpec& frame : frames) ids.insert(frame.id);
  std::string text;
  for (const FrameSpec& top : frames) {
    const bool follows = ids.count(top.parent) > 0 && taken.count(top.parent) == 0;
    if (taken.count(top.id) > 0 || (follows && !is_end(top.parent))) continue;
    std::string entry = top.id;
    Ids waiting{top.id};
    while (!waiting.empty()) {
      const std::string id = std::move(waiting.back());
      waiting.pop_back();
      if (is_end(id)) {
        entry += ".." + id;
      } else {
        waiting.insert(waiting.end(), below[id].rbegin(), below[id].rend());
      }
    }
    text += (text.empty() ? "" : ", ") + entry;
  }
  return text;
}

}  // namespace

Result<void> check_all_free(const Forest& forest, const Directory& directory,
                            const std::vector<FrameSpec>& frames) {
  std::map<std::string, Ids> by_owner;
  std::set<std::string> taken;
  for (const FrameSpec& frame : frames) {
    const auto there = forest.info(frame.id);
    if (!there || there->owner == kHeldHere) continue;
    by_owner[directory.name(there->owner)].push_back(frame.id);
    taken.insert(frame.id);
  }
  if (taken.empty()) return {};
  std::string text;
  for (const auto& [owner, ids] : by_owner) {
    text += (text.empty() ? "" : "; ") + listed(ids) + (ids.size() == 1 ? " belongs" : " belong") +
            " to partition " + quote(owner);
  }
  text += ". Leave out what others own";
  const std::string left = links_left(frames, taken);
  constexpr std::size_t kLongest = 400;
  if (!left.empty() && left.size() <= kLongest) {
    text += "; of a URDF by links: [" + printable(left) + "], without its prefix";
  }
  return fail(Errc::kAlreadyExists, text);
}

}  // namespace tfdude
