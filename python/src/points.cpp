#include "points.hpp"

#include "arguments.hpp"
#include "arrays.hpp"
#include "bind.hpp"
#include "session.hpp"

namespace tfdude::python {
namespace {

/// Points in another frame, and what they were.
struct TransformedArray {
  py::object transform;
  Points given;
  std::vector<TransformedPoint> points;
  Order order;

  /// An array (N, ...) with what `copy` writes of each point; (...) of a single one.
  template <class Copy>
  [[nodiscard]] py::array array(std::vector<py::ssize_t> shape, std::size_t each, Copy copy) const {
    std::vector<double> values(points.size() * each);
    for (std::size_t i = 0; i < points.size(); ++i) copy(points[i], values.data() + i * each);
    if (!given.single) shape.insert(shape.begin(), static_cast<py::ssize_t>(points.size()));
    return read_only(values.data(), std::move(shape));
  }
  [[nodiscard]] py::array vectors(Eigen::Vector3d TransformedPoint::*member) const {
    return array({3}, 3, [&](const TransformedPoint& point, double* to) {
      Eigen::Map<Eigen::Vector3d> copy(to);
      copy = point.*member;
    });
  }
  [[nodiscard]] py::array covariances() const {
    return array({3, 3}, 9, [](const TransformedPoint& point, double* to) {
      Eigen::Map<Eigen::Matrix3d> copy(to);  // symmetric: by rows as by columns
      copy = point.of_specified;
    });
  }
};

Eigen::Matrix3d matrix_at(const double* row_major) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row_major);
}

TransformedArray transformed_array(py::object transform, Points points, Order order) {
  const auto& X_AB = transform.cast<const Transform&>();
  TransformedArray array{transform, std::move(points), {}, order};
  array.points = without_gil([&] { return tfdude::transform(X_AB, array.given.all, order); });
  return array;
}

}  // namespace

Points to_points(py::handle points, py::handle covariance, bool direction) {
  const py::array any = py::array::ensure(points);
  PyErr_Clear();
  Points read;
  read.single = any && any.ndim() == 1;
  const Doubles p =
      read.single ? doubles(points, {3}, "points") : doubles(points, {-1, 3}, "points");
  const auto count = static_cast<std::size_t>(read.single ? 1 : p.shape(0));
  for (std::size_t i = 0; i < count; ++i) {
    Point point;
    point.coordinates = Eigen::Map<const Eigen::Vector3d>(p.data() + 3 * i);
    point.direction = direction;
    read.all.push_back(point);
  }
  if (!covariance.is_none()) {
    const py::array sigma = py::array::ensure(covariance);
    PyErr_Clear();
    const bool shared = sigma && sigma.ndim() == 2;
    const Doubles values =
        shared ? doubles(covariance, {3, 3}, "covariance")
               : doubles(covariance, {static_cast<py::ssize_t>(count), 3, 3}, "covariance");
    for (std::size_t i = 0; i < count; ++i) {
      read.all[i].covariance = matrix_at(values.data() + (shared ? 0 : 9 * i));
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (auto ok = check_point(read.all[i]); !ok) {
      raise(fail_at("point " + std::to_string(i), ok.error()).value());
    }
  }
  return read;
}

py::object transformed(py::object transform, Points points, Order order) {
  return py::cast(transformed_array(std::move(transform), std::move(points), order));
}

namespace {

/// What it was computed from, for a pickle.
py::tuple given_of(const TransformedArray& array) {
  const std::vector<Point>& given = array.given.all;
  std::vector<double> points;
  std::vector<double> covariances;
  for (const Point& one : given) {
    points.insert(points.end(), one.coordinates.data(), one.coordinates.data() + 3);
    covariances.insert(covariances.end(), one.covariance.data(), one.covariance.data() + 9);
  }
  const auto count = static_cast<py::ssize_t>(given.size());
  return py::make_tuple(array.transform, read_only(points.data(), {count, 3}),
                        read_only(covariances.data(), {count, 3, 3}), array.given.single,
                        !given.empty() && given.front().direction, static_cast<int>(array.order));
}

TransformedArray transformed_again(const py::tuple& state) {
  if (state.size() != 6 || !py::isinstance<Transform>(state[0])) {
    throw py::value_error("this was not pickled by this version of tfdude");
  }
  Points given = to_points(state[1], state[2], state[4].cast<bool>());
  given.single = state[3].cast<bool>() && given.all.size() == 1;
  return transformed_array(state[0], std::move(given), to_order(state[5].cast<int>()));
}

}  // namespace

void bind_points(py::module_& module) {
  py::class_<TransformedArray>(
      module, "Points",
      "Points (or directions) in another frame, with the errors of the transform and their own.\n"
      "Of N points the arrays have a first axis of N; of a single one (3,) they have not.")
      .def_property_readonly(
          "coordinates",
          [](const TransformedArray& a) { return a.vectors(&TransformedPoint::coordinates); },
          "(N, 3) [m]: the mean pose times the given points.")
      .def_property_readonly(
          "bias", [](const TransformedArray& a) { return a.vectors(&TransformedPoint::bias); },
          "(N, 3) [m]: how far the means are from `coordinates`, since angular errors bend the\n"
          "distribution of a point into a bow.")
      .def_property_readonly(
          "covariance",
          [](const TransformedArray& a) {
            require_complete(a.transform);
            return a.covariances();
          },
          "(N, 3, 3) [m²]. Raises UnspecifiedCovariance.")
      .def_property_readonly(
          "covariance_of_specified", [](const TransformedArray& a) { return a.covariances(); },
          "(N, 3, 3) [m²]; edges of unspecified covariance count as known exactly.")
      .def_property_readonly(
          "joint_covariance",
          [](const TransformedArray& a) {
            require_complete(a.transform);
            const auto& X_AB = a.transform.cast<const Transform&>();
            const Eigen::MatrixXd joint = joint_covariance(X_AB, a.given.all, a.order);
            return read_only(joint.data(), {joint.rows(), joint.cols()});
          },
          "(3N, 3N) [m²] of all points together: one transform moves all of them, so their errors\n"
          "are correlated. Raises UnspecifiedCovariance.")
      .def_property_readonly(
          "transform", [](const TransformedArray& a) { return a.transform; },
          "The Transform by which they came here.")
      .def("__len__", [](const TransformedArray& a) { return a.points.size(); })
      .def(py::pickle(&given_of, &transformed_again))
      .def("__repr__", [](const TransformedArray& a) {
        return "Points(" + std::to_string(a.points.size()) + ")";
      });
}

}  // namespace tfdude::python
