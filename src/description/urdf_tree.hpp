#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "description/urdf_text.hpp"

namespace tfdude {

/// A robot's links and what joins them: one tree, whose names are known once each.
struct UrdfTree {
  struct Link {
    std::string name;
    int line = 0;
    std::optional<std::size_t> joint;  ///< above it; none: the root link
    std::vector<std::size_t> joints;   ///< below it
  };
  struct Joint {
    std::string name;
    int line = 0;
    std::size_t parent = 0;
    std::size_t child = 0;
  };

  std::string file;
  std::vector<Link> links;    ///< as they stand in the file
  std::vector<Joint> joints;  ///< the same
  std::unordered_map<std::string, std::size_t> link_index;
  std::unordered_map<std::string, std::size_t> joint_index;
  std::size_t root = 0;

  /// About a joint, naming file, line and joint.
  [[nodiscard]] tl::unexpected<Error> joint_error(std::size_t joint,
                                                  const std::string& message) const;
};

/// @return kInvalidInput naming file, line and element: a name that is taken, an unknown link, a link with two parents, two
///   roots, a cycle.
[[nodiscard]] Result<UrdfTree> build_urdf_tree(const UrdfText& text, const std::string& file);

/// The links of a part (UrdfPart::links), each after the one above it.
/// @return kInvalidInput naming the file and the entry: an unknown link, an end that is not below, parts that overlap.
[[nodiscard]] Result<std::vector<std::size_t>> select_links(
    const UrdfTree& tree, const std::vector<std::string>& entries);

}  // namespace tfdude
