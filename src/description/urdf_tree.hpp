#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "description/urdf_text.hpp"

namespace tfdude {

/// A robot's links and joints: one tree, in which each name is unique.
struct UrdfTree {
  struct Link {
    std::string name;
    int line = 0;
    std::optional<std::size_t> joint;  ///< the joint above it; none: this is the root link
    std::vector<std::size_t> joints;   ///< the joints below it
  };
  struct Joint {
    std::string name;
    int line = 0;
    std::size_t parent = 0;
    std::size_t child = 0;
    std::optional<Eigen::Quaterniond> rotation{};  ///< as UrdfText::Joint::rotation
  };

  std::string file;
  std::vector<Link> links;    ///< in the order of the file
  std::vector<Joint> joints;  ///< in the order of the file
  std::unordered_map<std::string, std::size_t> link_index;
  std::unordered_map<std::string, std::size_t> joint_index;
  std::size_t root = 0;

  /// An error of a joint, naming file, line and joint.
  [[nodiscard]] tl::unexpected<Error> joint_error(std::size_t joint,
                                                  const std::string& message) const;
};

/// @return kInvalidInput naming file, line and element: a duplicate name, an unknown link, a link
/// with two parents, two roots, a cycle.
[[nodiscard]] Result<UrdfTree> build_urdf_tree(const UrdfText& text, const std::string& file);

/// The links of a part (UrdfPart::links); a parent comes before its children.
/// @return kInvalidInput naming the file and the entry: an unknown link, an end that is not below
/// the start, parts that overlap.
[[nodiscard]] Result<std::vector<std::size_t>> select_links(
    const UrdfTree& tree, const std::vector<std::string>& entries);

/// The entries that select exactly these links.
/// @param links  parents before their children
/// @return kInvalidInput: names have "..", so that no entries do
[[nodiscard]] Result<std::vector<std::string>> entries_for(const UrdfTree& tree,
                                                           const std::vector<std::size_t>& links);

}  // namespace tfdude
