#include "names.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

namespace tfdude::ros {
namespace {

// Takes as few characters as possible for each '*', and returns to the last one on a mismatch.
bool matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0;
  std::size_t n = 0;
  std::size_t star = std::string_view::npos;
  std::size_t resume = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++resume;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

}  // namespace

bool Patterns::match(std::string_view name) const {
  return std::any_of(patterns_.begin(), patterns_.end(),
                     [name](const std::string& pattern) { return matches(pattern, name); });
}

Result<std::string> id_of(std::string_view ros_name, const std::string& prefix) {
  const std::string_view name = without_slashes(ros_name);
  std::string id = name.empty() ? std::string() : prefix + std::string(name);
  constexpr std::size_t kShown = 60;
  if (auto ok = check_new_id(id, "id"); !ok) {
    return fail_at("frame " + quote(ros_name.substr(0, kShown)), ok.error());
  }
  return id;
}

std::optional<std::string> ros_name_of(std::string_view id, std::string_view prefix) {
  if (id.size() <= prefix.size() || id.substr(0, prefix.size()) != prefix) return std::nullopt;
  return std::string(id.substr(prefix.size()));
}

bool is_topic(std::string_view name) {
  if (!name.empty() && name.front() == '/') name.remove_prefix(1);
  char before = '/';
  for (const char c : name) {
    const bool is_digit = c >= '0' && c <= '9';
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    if (before == '/' ? !is_letter : !(is_letter || is_digit || c == '/')) return false;
    before = c;
  }
  return before != '/';
}

Result<Pose> pose_of(const RosPose& pose) {
  const auto& [x, y, z, w] = pose.quat;
  return pose_of(Eigen::Quaterniond(w, x, y, z),
                 Eigen::Vector3d(pose.xyz[0], pose.xyz[1], pose.xyz[2]));
}

RosPose ros_pose_of(const Pose& pose) {
  const Eigen::Vector3d p = pose.translation();
  const Eigen::Quaterniond q = pose.rotation();
  return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

}  // namespace tfdude::ros
