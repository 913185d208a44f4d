#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "tree/forest.hpp"

namespace tfdude::testing {

/// Dense value of an edge or a path; nothing of it is shared with the library's math.
struct NaiveTransform {
  Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
  Matrix6d sigma = Matrix6d::Zero();
};

[[nodiscard]] inline Matrix6d naive_adjoint(const Eigen::Matrix4d& X) {
  const Eigen::Matrix3d R = X.topLeftCorner<3, 3>();
  Eigen::Matrix3d cross;
  cross << 0, -X(2, 3), X(1, 3), X(2, 3), 0, -X(0, 3), -X(1, 3), X(0, 3), 0;
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = R;
  ad.topRightCorner<3, 3>() = cross * R;
  ad.bottomRightCorner<3, 3>() = R;
  return ad;
}

[[nodiscard]] inline NaiveTransform naive_compose(const NaiveTransform& AB,
                                                  const NaiveTransform& BC) {
  const Matrix6d ad_CB = naive_adjoint(BC.X.inverse());
  return {AB.X * BC.X, ad_CB * AB.sigma * ad_CB.transpose() + BC.sigma};
}

[[nodiscard]] inline NaiveTransform naive_inverse(const NaiveTransform& AB) {
  const Matrix6d ad_AB = naive_adjoint(AB.X);
  return {AB.X.inverse(), ad_AB * AB.sigma * ad_AB.transpose()};
}

/// What Forest promises, in the plainest way: a map of frames by id, each with its parent's id.
/// Functions return the name of the error, or "ok".
class NaiveForest {
 public:
  struct Frame {
    std::string parent;
    Owner owner = kHeldHere;
    std::uint64_t birth = 0;  // which of the frames of this id it is
    NaiveTransform value;
  };
  using Ids = std::vector<std::string>;

  std::string add(const std::string& id, const std::string& parent, const NaiveTransform& value,
                  bool may_wait) {
    if (bad(id) || (!parent.empty() && bad(parent))) return "invalid_input";
    if (has(id)) return "already_exists";
    if (!parent.empty() && !may_wait && !has(parent)) return "unknown_parent";
    if (closes_cycle(id, parent)) return "cycle";
    frames_[id] = {parent, kHeldHere, ++births_, value};
    return "ok";
  }

  std::string remove(const std::string& id, Ids& removed) {
    if (const std::string error = not_held(id); error != "ok") return error;
    removed = {id};
    for (std::size_t i = 0; i < removed.size(); ++i) {
      for (const auto& [child, frame] : frames_) {
        if (frame.parent == removed[i] && frame.owner == kHeldHere) removed.push_back(child);
      }
    }
    for (const std::string& gone : removed) frames_.erase(gone);
    return "ok";
  }

  std::string update(const std::vector<std::pair<std::string, NaiveTransform>>& edges) {
    for (const auto& edge : edges) {
      if (const std::string error = not_held(edge.first); error != "ok") return error;
    }
    for (const auto& [id, value] : edges) frames_[id].value = value;
    return "ok";
  }

  std::string move(const std::string& id, const std::string& parent, const NaiveTransform* value) {
    if (!parent.empty() && bad(parent)) return "invalid_input";
    if (const std::string error = not_held(id); error != "ok") return error;
    if (!parent.empty() && !has(parent)) return "unknown_parent";
    if (closes_cycle(id, parent)) return "cycle";
    frames_[id].parent = parent;
    if (value != nullptr) frames_[id].value = *value;
    return "ok";
  }

  std::string put_remote(const std::string& id, const std::string& parent, Owner owner) {
    if (bad(id) || (!parent.empty() && bad(parent)) || owner == kHeldHere) return "invalid_input";
    if (has(id) && frames_[id].owner == kHeldHere) return "already_exists";
    const bool cycle = closes_cycle(id, parent);
    const std::uint64_t birth = has(id) ? frames_[id].birth : ++births_;
    frames_[id] = {cycle ? "" : parent, owner, birth, {}};
    return cycle ? "cycle" : "ok";
  }

  void drop_remote(const std::string& id, Owner owner) {
    if (owner != kHeldHere && has(id) && frames_[id].owner == owner) frames_.erase(id);
  }

  /// @param absent_ends  whether an end may be a frame that is only named as a parent
  std::string lookup(const std::string& a, const std::string& b, bool absent_ends,
                     NaiveTransform& X_AB) const {
    Ids up;
    Ids down;
    const std::string found = path(a, b, absent_ends, up, down);
    if (found != "ok") return found;
    NaiveTransform X_CA;  // C: the common ancestor
    NaiveTransform X_CB;
    for (const std::string& id : up) {
      if (frames_.at(id).owner != kHeldHere) return "not_owner";
      X_CA = naive_compose(frames_.at(id).value, X_CA);
    }
    for (const std::string& id : down) {
      if (frames_.at(id).owner != kHeldHere) return "not_owner";
      X_CB = naive_compose(frames_.at(id).value, X_CB);
    }
    X_AB = naive_compose(naive_inverse(X_CA), X_CB);
    return "ok";
  }

  /// Runs as "from > to @owner".
  std::string segments(const std::string& a, const std::string& b, Ids& runs) const {
    Ids up;
    Ids down;
    const std::string found = path(a, b, false, up, down);
    if (found != "ok") return found;
    struct Step {
      std::string from, to;
      Owner owner;
    };
    std::vector<Step> steps;
    for (const std::string& id : up) {
      steps.push_back({id, frames_.at(id).parent, frames_.at(id).owner});
    }
    std::reverse(down.begin(), down.end());
    for (const std::string& id : down) {
      steps.push_back({frames_.at(id).parent, id, frames_.at(id).owner});
    }
    runs.clear();
    for (std::size_t i = 0; i < steps.size();) {
      std::size_t j = i;
      while (j + 1 < steps.size() && steps[j + 1].owner == steps[i].owner) ++j;
      runs.push_back(steps[i].from + " > " + steps[j].to + " @" + std::to_string(steps[i].owner));
      i = j + 1;
    }
    return "ok";
  }

  [[nodiscard]] bool has(const std::string& id) const { return frames_.count(id) != 0; }
  [[nodiscard]] const std::map<std::string, Frame>& frames() const { return frames_; }

  [[nodiscard]] Ids children(const std::string& id) const {
    Ids ids;
    for (const auto& [child, frame] : frames_) {
      if (frame.parent == id) ids.push_back(child);
    }
    return ids;
  }

  [[nodiscard]] Ids roots() const {
    Ids ids;
    for (const auto& [id, frame] : frames_) {
      if (!has(frame.parent)) ids.push_back(id);
    }
    return ids;
  }

  [[nodiscard]] Ids subtree(const std::string& id) const {
    Ids ids;
    for (const auto& [other, frame] : frames_) {
      const Ids above = line(other);
      if (has(id) && std::find(above.begin(), above.end(), id) != above.end()) ids.push_back(other);
    }
    return ids;
  }

 private:
  // Fit for the ids of the test: those that break a rule are empty, too long or hold a line break.
  static bool bad(const std::string& id) {
    return id.empty() || id.size() > 255 || id.find('\n') != std::string::npos;
  }

  // The frame, its parent and so on; the last may be one that is not there.
  [[nodiscard]] Ids line(const std::string& id) const {
    Ids ids{id};
    while (has(ids.back()) && !frames_.at(ids.back()).parent.empty()) {
      ids.push_back(frames_.at(ids.back()).parent);
    }
    return ids;
  }

  [[nodiscard]] bool closes_cycle(const std::string& id, const std::string& parent) const {
    const Ids above = line(parent);
    return std::find(above.begin(), above.end(), id) != above.end();
  }

  [[nodiscard]] std::string not_held(const std::string& id) const {
    if (!has(id)) return "unknown_frame";
    return frames_.at(id).owner == kHeldHere ? "ok" : "not_owner";
  }

  // The edges from each end up to the first common frame, by their children.
  std::string path(const std::string& a, const std::string& b, bool absent_ends, Ids& up,
                   Ids& down) const {
    const auto known = [&](const std::string& id) {
      return has(id) || (absent_ends && !id.empty() && !children(id).empty());
    };
    if (!known(a)) return "unknown_start";
    if (!known(b)) return "unknown_end";
    up = line(a);
    down = line(b);
    for (std::size_t i = 0; i < up.size(); ++i) {
      const auto meet = std::find(down.begin(), down.end(), up[i]);
      if (meet == down.end()) continue;
      if (!has(up[i]) && !absent_ends) break;
      up.resize(i);
      down.erase(meet, down.end());
      return "ok";
    }
    return "not_connected";
  }

  std::map<std::string, Frame> frames_;
  std::uint64_t births_ = 0;
};

}  // namespace tfdude::testing
