#include "description/config_frames.hpp"

#include <limits>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "tfdude/base/id.hpp"

#include "description/file_text.hpp"

namespace tfdude {
namespace {

// The index of a frame, by the frame's id or by the name of its joint.
using Names = std::unordered_map<std::string_view, std::size_t>;

Result<void> check_names(const Config& config) {
  Names frames;
  Names joints;
  for (std::size_t i = 0; i < config.frames.size(); ++i) {
    const FrameSpec& frame = config.frames[i];
    if (const auto [known, fresh] = frames.emplace(frame.id, i); !fresh) {
      return fail(Errc::kInvalidInput, config.places[i] + ": frame " + quote(frame.id) +
                                           ": id is taken by the frame in " +
                                           config.places[known->second]);
    }
    if (!frame.joint) continue;
    if (const auto [known, fresh] = joints.emplace(frame.joint->name, i); !fresh) {
      return fail(Errc::kInvalidInput, config.places[i] + ": joint " + quote(frame.joint->name) +
                                           ": name is taken by the joint in " +
                                           config.places[known->second]);
    }
  }
  return {};
}

}  // namespace

// Each frame climbs until it reaches a root, or a frame that an earlier climb has visited.
Result<void> check_no_cycle(const Config& config) {
  const auto& frames = config.frames;
  Names index;
  for (std::size_t i = 0; i < frames.size(); ++i) index.emplace(frames[i].id, i);
  constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> visitor(frames.size(), kNobody);
  for (std::size_t start = 0; start < frames.size(); ++start) {
    std::size_t here = start;
    while (visitor[here] == kNobody) {
      visitor[here] = start;
      const auto parent = index.find(frames[here].parent);
      if (parent == index.end()) break;
      if (visitor[parent->second] == start) {
        return fail(Errc::kInvalidInput, config.places[here] + ": frame " + quote(frames[here].id) +
                                             ": parent " + quote(frames[here].parent) +
                                             " is the frame itself or lies below it");
      }
      here = parent->second;
    }
  }
  return {};
}

Result<void> add_urdf(Config& config, const UrdfPart& part) {
  auto text = read_text(part.file);
  if (!text) return tl::unexpected(std::move(text.error()));
  auto frames = parse_urdf(*text, part);
  if (!frames) return tl::unexpected(std::move(frames.error()));
  const std::size_t before = config.frames.size();
  for (FrameSpec& frame : *frames) {
    config.frames.push_back(std::move(frame));
    config.places.push_back(part.file);
  }
  auto ok = check_names(config).and_then([&] { return check_no_cycle(config); });
  if (ok) {
    config.robots.push_back(*std::move(text));
    config.urdfs.push_back(part);
    return {};
  }
  config.frames.resize(before);
  config.places.resize(before);
  return ok;
}

}  // namespace tfdude
