#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/joint_spec.hpp"

#include "../rendering/angles.hpp"

// Samples of edges and joints as lines of text.
namespace tfdude::cli {

/// What one line says: values of one instant.
struct Sample {
  std::vector<EdgeUpdate> edges;
  std::vector<JointValue> joints;
  std::optional<Time> stamp;
};

/// Reads lines of JSON, or of CSV below a line of names; the first line decides which. The lines
/// are described in docs/cli.md.
class SampleReader {
 public:
  /// @param joints  the joints of the system by name, whose types say which positions are angles;
  ///   needed if the unit of angles is not radian
  explicit SampleReader(const AngleUnit& angles, std::map<std::string, JointInfo> joints = {})
      : angles_(angles), joints_(std::move(joints)) {}

  /// @return the line's values; none for an empty line or the names of CSV; kInvalidInput naming
  ///   what is wrong.
  [[nodiscard]] Result<std::optional<Sample>> read(const std::string& line);
  /// Call after the last line. @return kInvalidInput: it was the names of CSV, without values
  [[nodiscard]] Result<void> finish() const;

  /// A position or standard deviation of a joint [rad or m].
  [[nodiscard]] Result<double> position(const std::string& joint, double typed) const;

 private:
  enum class Form { kUndecided, kNoNames, kJson, kCsv };  // kNoNames: the first line was wrong

  [[nodiscard]] Result<Sample> read_object(const nlohmann::json& object) const;
  /// What a line of CSV says, as an object of JSON.
  [[nodiscard]] Result<nlohmann::json> read_row(const std::string& line) const;

  AngleUnit angles_;
  std::map<std::string, JointInfo> joints_;
  Form form_ = Form::kUndecided;
  std::vector<std::string> columns_;
  bool edges_ = false;  // a row is an edge; otherwise its columns are joints
  bool lacks_rows_ = false;
};

}  // namespace tfdude::cli
