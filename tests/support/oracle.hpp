#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tfdude/math/transform.hpp"

namespace tfdude::testing {

/// All frames in one tree, and the poses between them by plain matrices: the service must agree
/// with them. It is written from the formulas, and uses only the types of its arguments from the
/// library.
class Oracle {
 public:
  /// An empty parent makes a root.
  void add(const std::string& id, const std::string& parent, const Transform& X_PC);
  void update(const std::string& id, const Transform& X_PC);
  void move(const std::string& id, const std::string& parent) { frames_.at(id).parent = parent; }
  /// Removes a frame with all frames below it.
  void remove(const std::string& id);

  /// Sorted.
  [[nodiscard]] std::vector<std::string> ids() const;
  [[nodiscard]] const std::string& parent(const std::string& id) const {
    return frames_.at(id).parent;
  }
  [[nodiscard]] bool is_below(const std::string& id, const std::string& ancestor) const;

  /// X_AB; both frames exist and are connected.
  [[nodiscard]] Transform between(const std::string& a, const std::string& b) const;

 private:
  struct Value {
    Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
    Eigen::Matrix<double, 6, 6> sigma = Eigen::Matrix<double, 6, 6>::Zero();
    bool complete = true;  // no edge is unspecified
  };
  struct Frame {
    std::string parent;
    Value X_PC;
  };

  static Value value_of(const Transform& X);
  static Value inverse(const Value& X_AB);
  static Value compose(const Value& X_AB, const Value& X_BC);
  /// The frame and all above it, upwards.
  [[nodiscard]] std::vector<std::string> way_up(const std::string& id) const;

  std::map<std::string, Frame> frames_;
};

}  // namespace tfdude::testing
