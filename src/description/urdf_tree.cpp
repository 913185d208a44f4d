#include "description/urdf_tree.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "description/file_text.hpp"

namespace tfdude {
namespace {

// The links from `top` down, without those below an end.
std::vector<std::size_t> links_below(const UrdfTree& tree, std::size_t top,
                                     const std::vector<bool>& is_end) {
  std::vector<std::size_t> found;
  std::vector<std::size_t> waiting{top};
  while (!waiting.empty()) {
    const std::size_t link = waiting.back();
    waiting.pop_back();
    found.push_back(link);
    if (is_end[link]) continue;
    const auto& joints = tree.links[link].joints;
    for (auto joint = joints.rbegin(); joint != joints.rend(); ++joint) {
      waiting.push_back(tree.joints[*joint].child);
    }
  }
  return found;
}

tl::unexpected<Error> taken(const UrdfTree& tree, const char* kind, const std::string& name,
                            int line, int known) {
  return file_error(Errc::kInvalidInput, tree.file, line,
                    std::string(kind) + " " + quote(name) + ": the name is taken by the " + kind +
                        " in line " + std::to_string(known));
}

Result<std::size_t> end_of(const UrdfTree& tree, std::size_t joint, const char* which,
                           const std::string& name) {
  const auto link = tree.link_index.find(name);
  if (link != tree.link_index.end()) return link->second;
  return tree.joint_error(joint, std::string(which) + " link " + quote(name) + " does not exist");
}

Result<void> join(UrdfTree& tree, const UrdfText::Joint& said) {
  const std::size_t index = tree.joints.size();
  tree.joints.push_back({said.name, said.line, 0, 0, said.rotation});
  const auto [known, fresh] = tree.joint_index.emplace(said.name, index);
  if (!fresh) return taken(tree, "joint", said.name, said.line, tree.joints[known->second].line);
  const auto parent = end_of(tree, index, "parent", said.parent);
  if (!parent) return tl::unexpected(parent.error());
  const auto child = end_of(tree, index, "child", said.child);
  if (!child) return tl::unexpected(child.error());
  auto& above = tree.links[*child].joint;
  if (above) {
    return tree.joint_error(index, "child link " + quote(said.child) +
                                       " has a parent already, by joint " +
                                       quote(tree.joints[*above].name) + " in line " +
                                       std::to_string(tree.joints[*above].line));
  }
  above = index;
  tree.links[*parent].joints.push_back(index);
  tree.joints[index].parent = *parent;
  tree.joints[index].child = *child;
  return {};
}

// Names a joint of the cycle above a link that has no root above it.
tl::unexpected<Error> cycle(const UrdfTree& tree, std::size_t link) {
  std::vector<bool> seen(tree.links.size());
  while (!seen[link]) {
    seen[link] = true;
    link = tree.joints[*tree.links[link].joint].parent;
  }
  const std::size_t joint = *tree.links[link].joint;
  return tree.joint_error(joint, "parent link " +
                                     quote(tree.links[tree.joints[joint].parent].name) +
                                     " is the child link itself or lies below it");
}

Result<void> find_root(UrdfTree& tree) {
  std::optional<std::size_t> root;
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    if (tree.links[i].joint) continue;
    if (root) {
      return file_error(Errc::kInvalidInput, tree.file, tree.links[i].line,
                        "link " + quote(tree.links[i].name) + " is a second root link, beside " +
                            quote(tree.links[*root].name) + " in line " +
                            std::to_string(tree.links[*root].line));
    }
    root = i;
  }
  if (!root) return cycle(tree, 0);
  tree.root = *root;
  std::vector<bool> reached(tree.links.size());
  for (const auto link : links_below(tree, tree.root, reached)) reached[link] = true;
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    if (!reached[i]) return cycle(tree, i);
  }
  return {};
}

tl::unexpected<Error> refused(const UrdfTree& tree, const std::string& entry,
                              const std::string& why) {
  return fail(Errc::kInvalidInput, tree.file + ": links " + quote(entry) + ": " + why);
}

// The links that an entry names: FROM..TO[..TO], or one link.
Result<std::vector<std::size_t>> links_named(const UrdfTree& tree, const std::string& entry) {
  if (const auto whole = tree.link_index.find(entry); whole != tree.link_index.end()) {
    return std::vector<std::size_t>{whole->second};
  }
  std::vector<std::size_t> named;
  for (std::size_t begin = 0; begin <= entry.size();) {
    const std::size_t end = std::min(entry.find("..", begin), entry.size());
    const std::string name = entry.substr(begin, end - begin);
    const auto link = tree.link_index.find(name);
    if (link == tree.link_index.end()) {
      return refused(tree, entry, "link " + quote(name) + " does not exist");
    }
    named.push_back(link->second);
    begin = end + 2;
  }
  return named;
}

Result<std::vector<std::size_t>> links_of(const UrdfTree& tree, const std::string& entry) {
  auto named = links_named(tree, entry);
  if (!named) return named;
  std::vector<bool> is_end(tree.links.size());
  for (std::size_t i = 1; i < named->size(); ++i) is_end[(*named)[i]] = true;
  auto found = links_below(tree, named->front(), is_end);
  for (const auto link : found) is_end[link] = false;
  for (const auto end : *named) {
    if (!is_end[end]) continue;
    return refused(tree, entry,
                   "link " + quote(tree.links[end].name) + " is not below " +
                       quote(tree.links[named->front()].name) + ", or below another end");
  }
  return found;
}

}  // namespace

tl::unexpected<Error> UrdfTree::joint_error(std::size_t joint, const std::string& message) const {
  return file_error(Errc::kInvalidInput, file, joints[joint].line,
                    "joint " + quote(joints[joint].name) + ": " + message);
}

Result<UrdfTree> build_urdf_tree(const UrdfText& text, const std::string& file) {
  UrdfTree tree;
  tree.file = file;
  for (const auto& link : text.links) {
    const auto [known, fresh] = tree.link_index.emplace(link.name, tree.links.size());
    if (!fresh) return taken(tree, "link", link.name, link.line, tree.links[known->second].line);
    tree.links.push_back({link.name, link.line, {}, {}});
  }
  for (const auto& joint : text.joints) {
    if (auto ok = join(tree, joint); !ok) return tl::unexpected(ok.error());
  }
  if (auto ok = find_root(tree); !ok) return tl::unexpected(ok.error());
  return tree;
}

Result<std::vector<std::size_t>> select_links(const UrdfTree& tree,
                                              const std::vector<std::string>& entries) {
  if (entries.empty()) return links_below(tree, tree.root, std::vector<bool>(tree.links.size()));
  std::vector<std::size_t> selected;
  std::unordered_map<std::size_t, const std::string*> entry_of;
  for (const std::string& entry : entries) {
    auto links = links_of(tree, entry);
    if (!links) return links;
    for (const auto link : *links) {
      const auto [other, fresh] = entry_of.emplace(link, &entry);
      if (!fresh) {
        return refused(tree, entry,
                       "link " + quote(tree.links[link].name) + " belongs to " +
                           quote(*other->second) + ", too");
      }
      selected.push_back(link);
    }
  }
  return selected;
}

Result<std::vector<std::string>> entries_for(const UrdfTree& tree,
                                             const std::vector<std::size_t>& links) {
  std::vector<bool> wanted(tree.links.size());
  for (const std::size_t link : links) wanted[link] = true;
  // A link above one that is not wanted is an end, so that what else is below it needs entries of
  // its own.
  const auto is_end = [&](std::size_t link) {
    const auto& below = tree.links[link].joints;
    return std::any_of(below.begin(), below.end(),
                       [&](std::size_t joint) { return !wanted[tree.joints[joint].child]; });
  };
  std::vector<std::string> entries;
  for (const std::size_t top : links) {
    const auto& joint = tree.links[top].joint;
    const std::size_t above = joint ? tree.joints[*joint].parent : top;
    if (joint && wanted[above] && !is_end(above)) continue;
    std::string entry = tree.links[top].name;
    std::vector<std::size_t> waiting{top};
    while (!waiting.empty()) {
      const std::size_t link = waiting.back();
      waiting.pop_back();
      if (is_end(link)) {
        entry += ".." + tree.links[link].name;
        continue;
      }
      const auto& below = tree.links[link].joints;
      for (auto one = below.rbegin(); one != below.rend(); ++one) {
        waiting.push_back(tree.joints[*one].child);
      }
    }
    entries.push_back(std::move(entry));
  }
  auto selected = select_links(tree, entries);
  if (!selected) return tl::unexpected(std::move(selected.error()));
  return entries;
}

}  // namespace tfdude
