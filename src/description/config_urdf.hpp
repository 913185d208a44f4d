#pragma once

#include "tfdude/description/urdf.hpp"

#include "description/yaml_fields.hpp"

namespace tfdude {

/// Reads the entries of a configuration's key `urdf`.
class UrdfFields : public YamlFields {
 public:
  /// @param folder  the YAML file's folder; relative paths start there
  /// @param covariance  where none is given
  UrdfFields(std::string name, std::string folder, const StatedCovariance& covariance)
      : YamlFields(std::move(name)), folder_(std::move(folder)), covariance_(covariance) {}

  [[nodiscard]] Result<UrdfPart> part(const YAML::Node& node, const std::string& place) const;

 private:
  [[nodiscard]] Result<void> stand(const YAML::Node& node, const Fields& entries,
                                   const std::string& place, UrdfPart& part) const;
  [[nodiscard]] Result<void> links(const Fields& entries, const std::string& place,
                                   UrdfPart& part) const;
  [[nodiscard]] Result<UrdfJoint> joint(const YAML::Node& node, const std::string& place) const;

  std::string folder_;
  StatedCovariance covariance_;
};

}  // namespace tfdude
