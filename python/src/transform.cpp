#include <algorithm>
#include <array>

#include <pybind11/operators.h>

#include "tfdude/base/number.hpp"
#include "tfdude/math/earth.hpp"
#include "tfdude/math/interpolate.hpp"
#include "tfdude/math/perturbation.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "points.hpp"

namespace tfdude::python {
namespace {

Transform make(py::handle translation, py::handle quaternion, py::handle covariance,
               py::handle stddev) {
  if (!covariance.is_none() && !stddev.is_none()) {
    throw py::type_error("either covariance or stddev, not both");
  }
  Transform X;
  X.pose = value_of(Pose::create(
      quaternion.is_none() ? Eigen::Quaterniond::Identity()
                           : to_quaternion(quaternion, "quaternion"),
      translation.is_none() ? Eigen::Vector3d::Zero() : to_vector3(translation, "translation")));
  X.covariance = stddev.is_none() ? to_covariance(covariance) : from_stddev(stddev);
  return X;
}

/// The names of edges, if they are known, for the message.
std::string missing(const std::vector<std::string>& unspecified) {
  std::string text = "the covariance is not complete: ";
  if (unspecified.empty()) return text + "that of an edge is unspecified";
  text += "unspecified for ";
  for (std::size_t i = 0; i < unspecified.size(); ++i) {
    text += (i == 0 ? "'" : ", '") + unspecified[i] + "'";
  }
  return text;
}

/// "Transform(translation=[...], quaternion=[...], stddev=...)", short enough for a prompt.
std::string text_of(const Transform& X, const std::string& name) {
  std::string text;
  const auto list = [&](std::initializer_list<double> values) {
    const char* before = "[";
    for (const double value : values) {
      text += before + number_text(value + 0.0);  // no zero has a sign
      before = ", ";
    }
    text += "]";
  };
  const Eigen::Vector3d p = X.pose.translation();
  const Eigen::Quaterniond q = X.pose.rotation();
  text += name + "(translation=";
  list({p.x(), p.y(), p.z()});
  text += ", quaternion=";
  list({q.x(), q.y(), q.z(), q.w()});
  if (!X.covariance.complete()) {
    text += ", covariance='unspecified'";
  } else if (X.covariance == StatedCovariance::exact()) {
    text += ", covariance='exact'";
  } else {
    const std::array<double, 6> s = stddev_in_parent(X);
    // The name says so where the child has other axes than the parent.
    text += s == X.covariance.of_specified().stddev() ? ", stddev=" : ", stddev_in_parent=";
    list({s[0], s[1], s[2], s[3], s[4], s[5]});
  }
  return text + ")";
}

StatedCovariance converted(py::handle self, StatedCovariance (*convert)(const Transform&)) {
  require_complete(self);
  return convert(self.cast<const Transform&>());
}

void bind_construction(py::class_<Transform>& cls) {
  cls.def(py::init(&make), py::arg("translation") = py::none(), py::arg("quaternion") = py::none(),
          py::arg("covariance") = py::none(), py::kw_only(), py::arg("stddev") = py::none());
  cls.def_static(
      "exact",
      [](py::handle translation, py::handle quaternion) {
        return make(translation, quaternion, py::str("exact"), py::none());
      },
      py::arg("translation") = py::none(), py::arg("quaternion") = py::none(),
      "A transform that is known exactly: its covariance is zero.");
  cls.def_static(
      "from_matrix",
      [](py::handle matrix, py::handle covariance) {
        return Transform{value_of(Pose::from_matrix(to_matrix4(matrix, "matrix"))),
                         to_covariance(covariance)};
      },
      py::arg("matrix"), py::arg("covariance") = py::none(),
      "Of a homogeneous matrix (4, 4). ValueError if it is no rigid transform to 1e-6.");
  cls.def_static(
      "from_rpy",
      [](py::handle translation, py::handle rpy, py::handle covariance) {
        const Eigen::Vector3d angles = to_vector3(rpy, "rpy");
        return Transform{value_of(Pose::create(from_rpy(angles.x(), angles.y(), angles.z()),
                                               to_vector3(translation, "translation"))),
                         to_covariance(covariance)};
      },
      py::arg("translation"), py::arg("rpy"), py::arg("covariance") = py::none(),
      "Of fixed-axis angles (roll, pitch, yaw) as in URDF [rad].");
  cls.def_static(
      "exp",
      [](py::handle twist, py::handle covariance) {
        const Twist xi = to_twist(twist, "twist");
        const Pose X = xi.allFinite() ? tfdude::exp(xi) : Pose();
        // Checks the twist, too: its exponential is no number then.
        const Eigen::Vector3d p =
            xi.allFinite() ? X.translation() : Eigen::Vector3d::Constant(xi.sum());
        return Transform{value_of(Pose::create(X.rotation(), p)), to_covariance(covariance)};
      },
      py::arg("twist"), py::arg("covariance") = py::none(),
      "The exponential of a twist (6,): translation first [m], then rotation [rad].");
}

void bind_parts(py::class_<Transform>& cls) {
  cls.def_property_readonly(
      "translation",
      [](py::handle self) { return translation_view(self.cast<const Transform&>().pose, self); },
      "Origin of the child in the parent [m]; a read-only view (3,).");
  cls.def_property_readonly(
      "quaternion",
      [](py::handle self) { return quaternion_view(self.cast<const Transform&>().pose, self); },
      "Rotation (x, y, z, w), as scipy's Rotation.from_quat takes it; a read-only view (4,).");
  cls.def_property_readonly(
      "matrix", [](const Transform& X) { return from_matrix4(X.pose.matrix()); },
      "Homogeneous matrix (4, 4).");
  cls.def_property_readonly(
      "rpy", [](const Transform& X) { return from_vector3(to_rpy(X.pose.rotation())); },
      "Fixed-axis angles (roll, pitch, yaw) as in URDF [rad]; (3,).");
  cls.def_property_readonly(
      "geodetic", [](const Transform& X) { return value_of(geodetic_pose(X)); },
      "Where the child is on the Earth, if the parent is an earth frame (ECEF): GeodeticPose.");
  cls.def_property_readonly(
      "complete", [](const Transform& X) { return X.covariance.complete(); },
      "Whether the covariance is specified, and that of each edge it was computed from.");
  cls.def_property_readonly(
      "covariance",
      [](py::handle self) {
        require_complete(self);
        return from_matrix6(self.cast<const Transform&>().covariance.of_specified().matrix());
      },
      "Covariance (6, 6) of the right perturbation, expressed in the child: translation first\n"
      "[m², m·rad, rad²]. Raises UnspecifiedCovariance if it is not complete.");
  cls.def_property_readonly(
      "covariance_of_specified",
      [](const Transform& X) { return from_matrix6(X.covariance.of_specified().matrix()); },
      "Covariance (6, 6) of those edges that have one. The others count as known exactly, so it\n"
      "is too small if the transform is not complete.");
  cls.def_property_readonly(
      "stddev",
      [](py::handle self) {
        require_complete(self);
        return read_only(self.cast<const Transform&>().covariance.of_specified().stddev().data(),
                         {6});
      },
      "Square roots of the covariance's diagonal (6,): three [m], three [rad], along and about "
      "the\n"
      "axes of the child. Raises UnspecifiedCovariance.");
  cls.def_property_readonly(
      "stddev_in_parent",
      [](py::handle self) {
        require_complete(self);
        return read_only(stddev_in_parent(self.cast<const Transform&>()).data(), {6});
      },
      "What stands beside the numbers (6,): of the translation along the axes of the parent [m],\n"
      "then of the rotation about the axes of the child [rad]. Raises UnspecifiedCovariance.");
  cls.def_property_readonly(
      "left_covariance",
      [](py::handle self) {
        return from_matrix6(converted(self, left_covariance).of_specified().matrix());
      },
      "Covariance (6, 6) of the left perturbation, expressed in the parent. Raises\n"
      "UnspecifiedCovariance.");
  cls.def_property_readonly(
      "ros_covariance",
      [](py::handle self) {
        return from_matrix6(converted(self, ros_covariance).of_specified().matrix());
      },
      "Covariance (6, 6) as in ROS's PoseWithCovariance: along the parent's axes. Raises\n"
      "UnspecifiedCovariance.");
}

void bind_operations(py::class_<Transform>& cls) {
  cls.def(
      "__matmul__",
      [](const Transform& X_AB, py::handle other) -> py::object {
        if (py::isinstance<Transform>(other)) {
          return py::cast(compose(X_AB, other.cast<const Transform&>()));
        }
        return py::reinterpret_borrow<py::object>(Py_NotImplemented);
      },
      py::arg("X_BC"),
      "X_AC = X_AB @ X_BC with independent errors; the covariance to first order.");
  cls.def(
      "apply",
      [](const Transform& X, py::handle points) {
        const py::array any = py::array::ensure(points);
        PyErr_Clear();
        if (any && any.ndim() == 1) {
          return py::array(from_vector3(X.pose * to_vector3(points, "points")));
        }
        const Doubles p_B = doubles(points, {-1, 3}, "points");
        py::array_t<double> p_A({p_B.shape(0), py::ssize_t{3}});
        using Points = Eigen::Matrix<double, 3, Eigen::Dynamic>;
        const Eigen::Map<const Points> from(p_B.data(), 3, p_B.shape(0));
        Eigen::Map<Points>(p_A.mutable_data(), 3, p_B.shape(0)) =
            (X.pose.rotation().toRotationMatrix() * from).colwise() + X.pose.translation();
        return py::array(p_A);
      },
      py::arg("points"), "Points (3,) or (N, 3) of the child, in the parent [m].");
  cls.def(
      "transform",
      [](py::object self, py::handle points, py::handle covariance, bool direction, int order) {
        return transformed(std::move(self), to_points(points, covariance, direction),
                           to_order(order));
      },
      py::arg("points"), py::arg("covariance") = py::none(), py::kw_only(),
      py::arg("direction") = false, py::arg("order") = 2,
      "Points (3,) or (N, 3) of the child, in the parent, with their covariance: Points.\n\n"
      "covariance: of the points' own errors, (3, 3) or (N, 3, 3) [m²]; None: they are exact.\n"
      "direction: only turn them. order: 2 or 4, of the covariance's propagation. apply() is\n"
      "faster where no covariance is needed.");
  cls.def(
      "inverse", [](const Transform& X) { return inverse(X); },
      "X_BA of X_AB, with its covariance.");
  cls.def(
      "log", [](const Transform& X) { return from_twist(tfdude::log(X.pose)); },
      "The twist (6,) whose exponential this is: translation first [m], then rotation [rad].");
  cls.def(
      "adjoint", [](const Transform& X) { return from_matrix6(adjoint(X.pose)); },
      "The adjoint (6, 6).");
  cls.def(
      "interpolate",
      [](const Transform& X0, const Transform& X1, double s) {
        if (!(s >= 0 && s <= 1)) throw py::value_error("s must be within 0 and 1");
        return interpolate(X0, X1, s);
      },
      py::arg("X1"), py::arg("s"),
      "Between this (s = 0) and X1 (s = 1), with a constant twist. The covariance is an upper\n"
      "bound for any correlation.");
  cls.def(
      "with_covariance",
      [](const Transform& X, py::handle covariance) {
        return Transform{X.pose, to_covariance(covariance)};
      },
      py::arg("covariance"), "The same pose with another covariance.");
  cls.def("__eq__", [](const Transform& X, py::handle other) -> py::object {
    if (!py::isinstance<Transform>(other)) {
      return py::reinterpret_borrow<py::object>(Py_NotImplemented);
    }
    const auto& Y = other.cast<const Transform&>();
    return py::bool_(X.pose.rotation().coeffs() == Y.pose.rotation().coeffs() &&
                     X.pose.translation() == Y.pose.translation() && X.covariance == Y.covariance);
  });
  cls.attr("__hash__") = py::none();
  cls.attr("__array_ufunc__") = py::none();  // so that numpy leaves `@` with an array to this class
  cls.def("__repr__", [](py::handle self) {
    return text_of(self.cast<const Transform&>(),
                   py::str(py::type::handle_of(self).attr("__name__")));
  });
}

}  // namespace

StatedCovariance from_stddev(py::handle stddev) {
  const Doubles array = doubles(stddev, {6}, "stddev");
  std::array<double, 6> values{};
  std::copy_n(array.data(), values.size(), values.begin());
  return value_of(Covariance::from_stddev(values));
}

void require_complete(py::handle transform) {
  const auto& X = transform.cast<const Transform&>();
  if (X.covariance.complete()) return;
  std::vector<std::string> edges;
  if (py::isinstance<StampedTransform>(transform)) {
    edges = transform.cast<const StampedTransform&>().basis.unspecified;
  }
  raise_unspecified(missing(edges));
}

void raise_unspecified(const std::string& message) {
  const py::object type = py::module_::import("tfdude._errors").attr("UnspecifiedCovariance");
  PyErr_SetObject(type.ptr(), type("unspecified_covariance", message).ptr());
  throw py::error_already_set();
}

void bind_transform(py::module_& module) {
  py::class_<Transform> cls(
      module, "Transform",
      "X_AB, the pose of frame B in frame A, with the covariance of its right perturbation.\n\n"
      "Without arguments it is the identity, of unspecified covariance.\n\n"
      "translation: (3,) [m]. quaternion: (x, y, z, w), normalized if its norm is within 1e-3 of\n"
      "one. covariance: None or 'unspecified', 'exact', (6, 6), or the upper triangle (21,).\n"
      "stddev: instead, six standard deviations: three [m], three [rad].\n\n"
      "It cannot be changed. `@` composes, with covariance.");
  bind_construction(cls);
  bind_parts(cls);
  bind_operations(cls);
}

}  // namespace tfdude::python
