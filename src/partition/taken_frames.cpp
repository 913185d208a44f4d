#include "partition/taken_frames.hpp"

#include <algorithm>
#include <map>
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

}  // namespace

Result<void> check_all_free(const Forest& forest, const Directory& directory,
                            const std::vector<FrameSpec>& frames) {
  std::map<std::string, Ids> by_owner;
  for (const FrameSpec& frame : frames) {
    const auto there = forest.info(frame.id);
    if (!there || there->owner == kHeldHere) continue;
    by_owner[directory.name(there->owner)].push_back(frame.id);
  }
  if (by_owner.empty()) return {};
  std::string text;
  for (const auto& [owner, ids] : by_owner) {
    text += (text.empty() ? "" : "; ") + listed(ids) + (ids.size() == 1 ? " belongs" : " belong") +
            " to partition " + quote(owner);
  }
  return fail(Errc::kAlreadyExists, text + ". Leave out what others own");
}

}  // namespace tfdude
