#include "tfdude/description/urdf.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <utility>

#include "tfdude/base/id.hpp"

#include "description/file_text.hpp"
#include "description/urdf_edges.hpp"
#include "description/urdf_model.hpp"
#include "description/urdf_text.hpp"
#include "description/urdf_tree.hpp"

namespace tfdude {
namespace {

tl::unexpected<Error> link_error(const UrdfTree& tree, const UrdfTree::Link& link,
                                 const std::string& message) {
  return file_error(Errc::kInvalidInput, tree.file, link.line,
                    "link " + quote(link.name) + ": " + message);
}

// The given root must not be a frame of the robot itself, and the part must have the root link.
Result<void> check_root(const UrdfTree& tree, const UrdfPart& part,
                        const std::vector<std::size_t>& links) {
  if (part.root.empty()) return {};
  if (auto ok = check_new_id(part.root, "root"); !ok) return fail_at(tree.file, ok.error());
  if (std::find(links.begin(), links.end(), tree.root) == links.end()) {
    return fail(Errc::kInvalidInput, tree.file + ": root " + quote(part.root) +
                                         " is given, but the part is without the root link " +
                                         quote(tree.links[tree.root].name));
  }
  for (const auto& link : tree.links) {
    if (part.prefix + link.name == part.root) return link_error(tree, link, "is the root given");
  }
  return {};
}

Result<FrameSpec> frame(const UrdfTree& tree, const UrdfTree::Link& link,
                        const std::vector<UrdfEdge>& edges, const UrdfPart& part) {
  FrameSpec spec;
  spec.id = part.prefix + link.name;
  if (auto ok = check_new_id(spec.id, "name"); !ok)
    return link_error(tree, link, ok.error().message);
  if (!link.joint) {
    spec.parent = part.root;
    if (!part.root.empty()) spec.X_PC = part.X_root;
    return spec;
  }
  spec.parent = part.prefix + tree.links[tree.joints[*link.joint].parent].name;
  const UrdfEdge& edge = edges[*link.joint];
  spec.joint = edge.joint;
  spec.X_PC = edge.X_PJ;
  if (edge.joint) spec.X_PC = value_at(*edge.joint, edge.joint->position, edge.joint->variance);
  const auto pose = Pose::create(spec.X_PC.pose.rotation(), spec.X_PC.pose.translation());
  if (!pose) return tree.joint_error(*link.joint, pose.error().message);
  if (auto ok = check_finite(spec.X_PC); !ok) {
    return tree.joint_error(*link.joint, ok.error().message);
  }
  return spec;
}

Result<std::vector<FrameSpec>> read_frames(const std::string& text, const UrdfPart& part) {
  const auto read = read_urdf_text(text, part.file);
  if (!read) return tl::unexpected(read.error());
  const auto tree = build_urdf_tree(*read, part.file);
  if (!tree) return tl::unexpected(tree.error());
  const auto joints = read_urdf_joints(*read, part.file);
  if (!joints) return tl::unexpected(joints.error());
  const auto links = select_links(*tree, part.links);
  if (!links) return tl::unexpected(links.error());
  const auto edges = read_urdf_edges(*tree, *joints, part, *links);
  if (!edges) return tl::unexpected(edges.error());
  if (auto ok = check_root(*tree, part, *links); !ok) return tl::unexpected(ok.error());
  std::vector<FrameSpec> frames;
  for (const auto link : *links) {
    auto spec = frame(*tree, tree->links[link], *edges, part);
    if (!spec) return tl::unexpected(std::move(spec.error()));
    frames.push_back(*std::move(spec));
  }
  return frames;
}

}  // namespace

Result<std::vector<FrameSpec>> parse_urdf(const std::string& text, const UrdfPart& part) {
  // Messages contain the name of the file, so it must be printable.
  UrdfPart named = part;
  named.file = printable(part.file);
  try {
    return read_frames(text, named);
  } catch (const std::exception& e) {
    return fail(Errc::kConfig, named.file + ": " + printable(e.what()));
  }
}

Result<std::vector<FrameSpec>> load_urdf(const UrdfPart& part) {
  const auto text = read_text(part.file);
  if (!text) return tl::unexpected(text.error());
  return parse_urdf(*text, part);
}

Result<std::optional<UrdfPart>> urdf_without(const UrdfPart& part,
                                             const std::set<std::string>& taken) {
  const auto text = read_text(part.file);
  if (!text) return tl::unexpected(text.error());
  const std::string file = printable(part.file);
  const auto read = read_urdf_text(*text, file);
  if (!read) return tl::unexpected(read.error());
  const auto tree = build_urdf_tree(*read, file);
  if (!tree) return tl::unexpected(tree.error());
  const auto all = select_links(*tree, part.links);
  if (!all) return tl::unexpected(all.error());
  std::vector<std::size_t> left;
  std::copy_if(all->begin(), all->end(), std::back_inserter(left), [&](std::size_t link) {
    return taken.count(part.prefix + tree->links[link].name) == 0;
  });
  if (left.empty()) return std::nullopt;
  if (left.size() == all->size()) return part;
  auto entries = entries_for(*tree, left);
  if (!entries) return tl::unexpected(std::move(entries.error()));
  UrdfPart rest = part;
  rest.links = *std::move(entries);
  if (std::find(left.begin(), left.end(), tree->root) == left.end()) rest.root.clear();
  return rest;
}

}  // namespace tfdude
