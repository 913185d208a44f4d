#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// Reads the nodes of one YAML file, with errors that name the file, the line and the key.
class YamlFields {
 public:
  /// A key's value, and its place in the file; the place of the key if the value is empty.
  struct Field {
    YAML::Node value;
    YAML::Mark mark;
  };

  /// The entries of a mapping, by key.
  using Fields = std::map<std::string, Field, std::less<>>;

  /// @param name  the file's name, for messages
  explicit YamlFields(std::string name) : name_(std::move(name)) {}

  [[nodiscard]] tl::unexpected<Error> error(Errc code, const YAML::Mark& mark,
                                            const std::string& message) const;

  /// Passes the root of the file's only document to `read`, and returns what that does.
  /// @return also kConfig: not YAML, empty, several documents, or aliases that repeat too much. So
  ///   `read` may follow aliases without limits of its own.
  [[nodiscard]] Result<void> read_document(
      const std::string& text, const std::function<Result<void>(const YAML::Node&)>& read) const;

 protected:
  [[nodiscard]] const std::string& name() const { return name_; }
  /// "FILE:LINE", or the file alone if the mark has no line.
  [[nodiscard]] std::string place(const YAML::Mark& mark) const;

  /// The entries of a mapping. @param allowed  the keys it may have; empty or left out: any
  template <std::size_t N>
  [[nodiscard]] Result<Fields> fields(const YAML::Node& map,
                                      const std::array<std::string_view, N>& allowed,
                                      const std::string& what) const {
    return fields(map, std::vector<std::string_view>(allowed.begin(), allowed.end()), what);
  }
  [[nodiscard]] Result<Fields> fields(const YAML::Node& map, const std::string& what) const {
    return fields(map, std::vector<std::string_view>(), what);
  }

  [[nodiscard]] Result<std::string> text(const Field& field, const std::string& what) const;
  [[nodiscard]] Result<double> number(const YAML::Node& node, const std::string& what) const;

  /// A list of exactly N numbers under a key. Without the key, `out` stays as it is.
  template <std::size_t N>
  [[nodiscard]] Result<void> numbers(const Fields& fields, std::string_view key,
                                     const std::string& place,
                                     std::optional<std::array<double, N>>& out) const;
  [[nodiscard]] Result<void> number(const Fields& fields, std::string_view key,
                                    const std::string& place, std::optional<double>& out) const;
  [[nodiscard]] Result<void> flag(const Fields& fields, std::string_view key,
                                  const std::string& place, bool& out) const;
  /// The id under `key`, which must exist.
  [[nodiscard]] Result<std::string> id(const Fields& fields, std::string_view key,
                                       const std::string& place) const;
  /// The transform given by xyz, rpy or quat, and stddev, cov or covariance. Missing keys mean the
  /// identity.
  /// @param otherwise  the covariance if none is given
  [[nodiscard]] Result<Transform> transform(const YAML::Node& node, const Fields& fields,
                                            const std::string& place,
                                            const StatedCovariance& otherwise) const;
  /// Rejects a pose of transform(), where there is nothing that it would place.
  /// @param needs  what is missing, as in "needs root: ..."
  [[nodiscard]] Result<void> check_no_pose(const Fields& fields, const std::string& place,
                                           const std::string& needs) const;
  /// As check_no_pose(), also of a covariance.
  [[nodiscard]] Result<void> check_no_transform(const Fields& fields, const std::string& place,
                                                const std::string& needs) const;

 private:
  [[nodiscard]] Result<Fields> fields(const YAML::Node& map,
                                      const std::vector<std::string_view>& allowed,
                                      const std::string& what) const;

  [[nodiscard]] Result<void> check_none(const Fields& fields, const std::vector<const char*>& keys,
                                        const std::string& place, const std::string& needs) const;

  std::string name_;
};

template <std::size_t N>
Result<void> YamlFields::numbers(const Fields& fields, std::string_view key,
                                 const std::string& place,
                                 std::optional<std::array<double, N>>& out) const {
  const auto found = fields.find(key);
  if (found == fields.end()) return {};
  const YAML::Node& list = found->second.value;
  const std::string what = place + ": " + found->first;
  if (!list.IsSequence() || list.size() != N) {
    const std::string has =
        list.IsSequence() ? " has " + std::to_string(list.size()) + ", not " : " is not a list of ";
    return error(Errc::kConfig, found->second.mark, what + has + std::to_string(N) + " numbers");
  }
  out.emplace();
  for (std::size_t i = 0; i < N; ++i) {
    const auto value = number(list[i], what + "[" + std::to_string(i) + "]");
    if (!value) return tl::unexpected(value.error());
    (*out)[i] = *value;
  }
  return {};
}

}  // namespace tfdude
