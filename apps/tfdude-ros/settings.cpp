#include "settings.hpp"

#include <charconv>

#include "tfdude/base/id.hpp"

namespace tfdude::ros {
namespace {

constexpr std::uint32_t kMaxDomain = 232;

tl::unexpected<Error> bad(const char* name, const std::string& value, const char* what) {
  return fail(Errc::kInvalidInput, std::string(name) + "=" + printable(value) + ": " + what);
}

}  // namespace

ImportSettings import_of(const Settings& settings) {
  ImportSettings import = settings.frames_in.value_or(ImportSettings());
  import.prefix = settings.prefix;
  import.drifts = settings.drifts;
  return import;
}

Result<void> check_partitions(const Settings& settings) {
  const bool same =
      settings.description_in && settings.description_in->partition == settings.partition;
  if (!same) return {};
  return fail(Errc::kInvalidInput, "partition " + quote(settings.partition) +
                                       " is that of the frames of /tf: description_in needs "
                                       "another one");
}

void set_prefix(const std::string& prefix, Settings& settings) {
  settings.prefix = prefix;
  if (settings.frames_in) settings.frames_in->prefix = prefix;
  if (settings.frames_out) settings.frames_out->prefix = prefix;
  if (settings.joints_in) settings.joints_in->prefix = prefix;
  if (settings.joints_out) settings.joints_out->prefix = prefix;
  if (settings.description_in) settings.description_in->part.prefix = prefix;
  for (ValueIn& one : settings.values_in) one.prefix = prefix;
  for (DetectionsIn& one : settings.detections_in) one.prefix = prefix;
  for (PoseIn& one : settings.poses_in) one.prefix = prefix;
  for (PoseOut& one : settings.poses_out) one.prefix = prefix;
}

Result<void> read_environment(const std::function<std::string(const char* name)>& variable,
                              Settings& settings) {
  constexpr const char* kDomain = "ROS_DOMAIN_ID";
  constexpr const char* kRange = "ROS_AUTOMATIC_DISCOVERY_RANGE";
  if (const std::string text = variable(kDomain); !text.empty()) {
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, settings.ros_domain);
    if (read.ec != std::errc() || read.ptr != end || settings.ros_domain > kMaxDomain) {
      return bad(kDomain, text, "must be 0 to 232");
    }
  }
  const std::string range = variable(kRange);
  if (range == "OFF") return bad(kRange, range, "no node can be discovered");
  if (range == "LOCALHOST") {
    settings.range = Range::kThisComputer;
  } else if (!range.empty() && range != "SUBNET" && range != "SYSTEM_DEFAULT") {
    return bad(kRange, range, "must be SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT");
  }
  // Where both are set, ROS heeds this one.
  if (variable("ROS_LOCALHOST_ONLY") == "1") settings.range = Range::kThisComputer;
  return {};
}

}  // namespace tfdude::ros
