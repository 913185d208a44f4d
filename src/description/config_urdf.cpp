#include "description/config_urdf.hpp"

#include <filesystem>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

constexpr std::array<std::string_view, 14> kUrdfKeys = {
    "file",   "root", "xyz",        "rpy",    "quat",  "matrix",        "geodetic",
    "stddev", "cov",  "covariance", "prefix", "links", "strict_limits", "joints"};
constexpr std::array<std::string_view, 4> kJointKeys = {"position", "stddev", "sample_stddev",
                                                        "origin"};
// The key in files of earlier versions.
constexpr const char* kFormerOrigin = "mount";
constexpr std::array<std::string_view, 4> kFormerJointKeys = {"position", "stddev", "sample_stddev",
                                                              kFormerOrigin};
constexpr std::array<std::string_view, 3> kOriginKeys = {"stddev", "cov", "covariance"};

}  // namespace

// Reads the parent frame of the robot's root link, and the root link's pose in it.
Result<void> UrdfFields::stand(const YAML::Node& node, const Fields& entries,
                               const std::string& place, UrdfPart& part) const {
  if (entries.find("root") == entries.end()) {
    return check_no_transform(entries, place, "needs root: it places the root link in that frame");
  }
  auto root = id(entries, "root", place);
  if (!root) return tl::unexpected(std::move(root.error()));
  part.root = *std::move(root);
  const auto X_root = transform(node, entries, place, covariance_);
  if (!X_root) return tl::unexpected(X_root.error());
  part.X_root = *X_root;
  return {};
}

Result<void> UrdfFields::links(const Fields& entries, const std::string& place,
                               UrdfPart& part) const {
  const auto found = entries.find("links");
  if (found == entries.end()) return {};
  const YAML::Node& list = found->second.value;
  if (!list.IsSequence() || list.size() == 0) {
    return error(Errc::kConfig, found->second.mark, place + ": links is not a list of links");
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    const YAML::Node entry = list[i];
    auto link = text({entry, entry.Mark()}, place + ": links[" + std::to_string(i) + "]");
    if (!link) return tl::unexpected(std::move(link.error()));
    part.links.push_back(*std::move(link));
  }
  return {};
}

Result<UrdfJoint> UrdfFields::joint(const YAML::Node& node, const std::string& place) const {
  const bool former = node.IsMap() && node[kFormerOrigin].IsDefined();
  const auto entries = fields(node, former ? kFormerJointKeys : kJointKeys, place);
  if (!entries) return tl::unexpected(entries.error());
  UrdfJoint joint;
  const auto read =
      number(*entries, "position", place, joint.position)
          .and_then([&] { return number(*entries, "stddev", place, joint.stddev); })
          .and_then([&] { return number(*entries, "sample_stddev", place, joint.sample_stddev); });
  if (!read) return tl::unexpected(read.error());
  const std::string key = former ? kFormerOrigin : "origin";
  const auto origin = entries->find(key);
  if (origin == entries->end()) return joint;
  const std::string what = place + ": " + key;
  const auto said = fields(origin->second.value, kOriginKeys, what);
  if (!said) return tl::unexpected(said.error());
  const auto error_of = transform(origin->second.value, *said, what, covariance_);
  if (!error_of) return tl::unexpected(error_of.error());
  joint.origin = error_of->covariance;
  return joint;
}

Result<UrdfPart> UrdfFields::part(const YAML::Node& node, const std::string& place) const {
  const auto entries = fields(node, kUrdfKeys, place);
  if (!entries) return tl::unexpected(entries.error());
  const auto given = [&](std::string_view key) { return entries->find(key); };
  UrdfPart part;
  part.fixed = covariance_;
  if (given("file") == entries->end()) {
    return error(Errc::kConfig, node.Mark(), place + ": file is missing");
  }
  const auto file = text(given("file")->second, place + ": file");
  if (!file) return tl::unexpected(file.error());
  part.file = (std::filesystem::path(folder_) / *file).string();
  if (const auto found = given("prefix"); found != entries->end()) {
    auto prefix = text(found->second, place + ": prefix");
    if (!prefix) return tl::unexpected(std::move(prefix.error()));
    part.prefix = *std::move(prefix);
  }
  const auto read =
      stand(node, *entries, place, part)
          .and_then([&] { return links(*entries, place, part); })
          .and_then([&] { return flag(*entries, "strict_limits", place, part.strict_limits); });
  if (!read) return tl::unexpected(read.error());
  const auto found = given("joints");
  if (found == entries->end()) return part;
  const auto joints = fields(found->second.value, place + ": joints");
  if (!joints) return tl::unexpected(joints.error());
  for (const auto& [name, field] : *joints) {
    const auto said = joint(field.value, place + ": joint " + quote(name));
    if (!said) return tl::unexpected(said.error());
    part.joints.emplace(name, *said);
  }
  return part;
}

}  // namespace tfdude
