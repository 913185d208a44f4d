#include <variant>

#include "arrays.hpp"
#include "bind.hpp"
#include "client.hpp"
#include "many.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

/// A cloud in double or single precision, as its points were given.
struct Cloud {
  std::variant<TransformedCloud<double>, TransformedCloud<float>> all;
  bool has_covariances = false;

  template <class Visit>
  auto visit(Visit visit) const {
    return std::visit([&](const auto& cloud) { return visit(cloud); }, all);
  }
};

template <class Number>
using Numbers = py::array_t<Number, py::array::c_style | py::array::forcecast>;

bool is_single(py::handle points) {
  if (!py::isinstance<py::array>(points)) return false;
  const auto array = py::reinterpret_borrow<py::array>(points);
  return array.dtype().kind() == 'f' && array.itemsize() == static_cast<py::ssize_t>(sizeof(float));
}

/// The caller's own memory, if it is contiguous, else a copy.
template <class Number>
Numbers<Number> to_cloud(py::handle points) {
  const py::array any = py::array::ensure(points);
  PyErr_Clear();
  const char kind = any ? any.dtype().kind() : 'O';
  if (kind != 'f' && kind != 'i' && kind != 'u') throw py::type_error("points must be numbers");
  if (any.ndim() != 2 || any.shape(1) != 3) {
    throw py::value_error("points must have the shape (N, 3), not " +
                          std::string(py::str(any.attr("shape"))));
  }
  return Numbers<Number>(any);
}

template <class Number>
Eigen::Map<const Eigen::Matrix<Number, 3, Eigen::Dynamic>> columns(const Numbers<Number>& points) {
  return {points.data(), 3, points.shape(0)};
}

Eigen::Matrix3d to_own(py::handle own) {
  if (own.is_none()) return Eigen::Matrix3d::Zero();
  const Doubles values = doubles(own, {3, 3}, "own");
  const Eigen::Matrix3d sigma = Eigen::Map<const Eigen::Matrix3d>(values.data());
  Matrix6d whole = Matrix6d::Zero();
  whole.topLeftCorner<3, 3>() = sigma;
  return value_of(Covariance::from_matrix(whole)).matrix().topLeftCorner<3, 3>();
}

CloudQuery to_cloud_query(py::handle at, py::handle stamps, py::handle group,
                          const std::string& fixed, bool covariances, py::handle own) {
  CloudQuery query;
  query.lookup.at = to_stamp(at, "at");
  if (!stamps.is_none()) query.stamps = to_instants(stamps, "stamps");
  query.group = to_duration(group, "group");
  query.fixed = fixed;
  query.covariances = covariances;
  query.own = to_own(own);
  return query;
}

template <class Number>
Cloud transform_cloud(const Session& session, const std::string& a, const std::string& b,
                      py::handle points, const CloudQuery& query, Milliseconds wait) {
  const Numbers<Number> given = to_cloud<Number>(points);
  const auto from = columns(given);
  const auto ready = [&](Milliseconds left) -> Result<void> {
    Query last = query.lookup;
    if (!query.stamps.empty()) {
      last.at = std::max(*std::max_element(query.stamps.begin(), query.stamps.end()),
                         last.at.value_or(Time{}));
    }
    if (query.fixed.empty()) {
      (void)wait_for_lookup(session, a, b, last, left);
    } else {
      const auto end = std::chrono::steady_clock::now() + std::min(left, Milliseconds(1 << 30));
      (void)wait_for_lookup(session, query.fixed, a, last, left);
      const auto rest = std::chrono::ceil<Milliseconds>(end - std::chrono::steady_clock::now());
      if (rest > Milliseconds(0)) (void)wait_for_lookup(session, query.fixed, b, last, rest);
    }
    return {};
  };
  return {value_of(call_when_ready(session, wait, ready,
                                   [&](Client& c) {
                                     return c.transform_cloud(
                                         a, b, Eigen::Ref<const Eigen::Matrix<Number, 3, -1>>(from),
                                         query);
                                   })),
          query.covariances};
}

/// By one transform, into memory of another cloud. It is never freed: arrays show it.
template <class Number>
void by_transform(const Transform& X_AB, py::handle points, bool covariances, py::handle own,
                  Cloud& out, bool is_new) {
  const Numbers<Number> given = to_cloud<Number>(points);
  const auto from = columns(given);
  const Eigen::Matrix3d own_covariance = to_own(own);
  if (is_new) out.all = TransformedCloud<Number>();
  auto* const same = std::get_if<TransformedCloud<Number>>(&out.all);
  if (same == nullptr || (!is_new && same->points.cols() != from.cols())) {
    throw py::value_error("out must have as many points, of the same type of numbers");
  }
  auto& cloud = *same;
  without_gil([&] {
    cloud.points.resize(3, from.cols());
    if (covariances) {
      cloud.covariances.resize(6, from.cols());
      tfdude::transform_cloud(X_AB, from, cloud.points, cloud.covariances, own_covariance);
    } else {
      tfdude::transform_cloud(X_AB.pose, from, cloud.points);
    }
  });
  cloud.complete = X_AB.covariance.complete();
  cloud.basis = {};
  out.has_covariances = covariances;
}

/// A view of numbers of the cloud, which it keeps alive.
template <class Number>
py::array view(const Number* first, std::vector<py::ssize_t> shape, py::handle owner) {
  return py::array(py::dtype::of<Number>(), std::move(shape), first, owner);
}

void require_covariances(const Cloud& cloud) {
  if (!cloud.has_covariances) {
    throw py::value_error("ask for covariances: transform_cloud(..., covariance=True)");
  }
}

py::array square_covariances(const Cloud& cloud) {
  require_covariances(cloud);
  return cloud.visit([](const auto& one) -> py::array {
    using Number = typename std::decay_t<decltype(one.points)>::Scalar;
    const py::ssize_t count = one.points.cols();
    py::array_t<Number> array({count, py::ssize_t{3}, py::ssize_t{3}});
    Number* to = array.mutable_data();
    const Number* from = one.covariances.data();
    for (py::ssize_t i = 0; i < count; ++i, from += 6, to += 9) {
      to[0] = from[0];
      to[1] = to[3] = from[1];
      to[2] = to[6] = from[2];
      to[4] = from[3];
      to[5] = to[7] = from[4];
      to[8] = from[5];
    }
    return array;
  });
}

void bind_cloud(py::module_& module) {
  py::class_<Cloud>(module, "Cloud",
                    "Points in another frame, of the type of numbers in which they were given.")
      .def_property_readonly(
          "points",
          [](py::handle self) {
            return self.cast<const Cloud&>().visit([&](const auto& one) {
              return view(one.points.data(), {one.points.cols(), 3}, self);
            });
          },
          "(N, 3) [m].")
      .def_property_readonly(
          "upper",
          [](py::handle self) {
            require_covariances(self.cast<const Cloud&>());
            return self.cast<const Cloud&>().visit([&](const auto& one) {
              return view(one.covariances.data(), {one.covariances.cols(), 6}, self);
            });
          },
          "(N, 6) [m²]: xx, xy, xz, yy, yz, zz of each covariance, of those edges that have one.")
      .def_property_readonly(
          "covariances",
          [](const Cloud& cloud) {
            const auto unspecified = cloud.visit([](const auto& one) {
              return std::make_pair(one.complete, one.basis.unspecified);
            });
            if (!unspecified.first) {
              StampedTransform incomplete;
              incomplete.basis.unspecified = unspecified.second;
              require_complete(py::cast(incomplete));
            }
            return square_covariances(cloud);
          },
          "(N, 3, 3) [m²], copied on each access. Raises UnspecifiedCovariance.")
      .def_property_readonly("covariances_of_specified", &square_covariances,
                             "(N, 3, 3) [m²], of those edges that have one.")
      .def_property_readonly(
          "complete",
          [](const Cloud& cloud) {
            return cloud.visit([](const auto& one) { return one.complete; });
          },
          "Whether no edge has an unspecified covariance.")
      .def("__len__",
           [](const Cloud& cloud) {
             return cloud.visit([](const auto& one) { return one.points.cols(); });
           })
      .def("__repr__", [](const Cloud& cloud) {
        return "Cloud(" +
               std::to_string(cloud.visit([](const auto& one) { return one.points.cols(); })) +
               " points)";
      });
}

}  // namespace

void bind_clouds(py::module_& module, ClientClass& cls, py::handle transform) {
  bind_cloud(module);
  cls.def(
      "transform_cloud",
      [](const Session& session, const std::string& a, const std::string& b, py::handle points,
         py::handle at, py::handle stamps, py::handle group, const std::string& fixed,
         bool covariance, py::handle own, py::handle timeout) {
        const CloudQuery query =
            to_cloud_query(at, stamps, group, fixed, covariance || !own.is_none(), own);
        // To C++ no stamps are those that were not given.
        if (!stamps.is_none() && query.stamps.empty() && py::len(points) > 0) {
          throw py::value_error(std::to_string(py::len(points)) + " points, but 0 stamps");
        }
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        return is_single(points) ? transform_cloud<float>(session, a, b, points, query, wait)
                                 : transform_cloud<double>(session, a, b, points, query, wait);
      },
      py::arg("a"), py::arg("b"), py::arg("points"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("stamps") = py::none(), py::arg("group") = 0.0, py::arg("fixed") = "",
      py::arg("covariance") = false, py::arg("own") = py::none(), py::arg("timeout") = 0.0,
      "A cloud of points (N, 3) of frame b, in frame a: a Cloud, in float32 or float64 as "
      "given.\n\n"
      "stamps: (N,), when each point was measured, as by a rotating lidar; each stamp that occurs\n"
      "is looked up once. group [s]: stamps of one interval of this length are looked up as one.\n"
      "fixed: frame a is that of the instant `at` (None: of the last stamp), and this frame is\n"
      "assumed fixed meanwhile: transform_cloud('lidar', 'lidar', points, stamps=t, "
      "fixed='odom').\n"
      "covariance: also compute one for each point. own: (3, 3), of each point's own error.\n"
      "timeout [s]: how long to wait for the last stamp. Raises as lookup(), also if one stamp "
      "has\n"
      "no data.");
  transform.attr("transform_cloud") = py::cpp_function(
      [](const Transform& X_AB, py::handle points, bool covariance, py::handle own,
         py::object out) {
        const bool is_new = out.is_none();
        if (is_new) out = py::cast(Cloud());
        const bool with = covariance || !own.is_none();
        auto& cloud = out.cast<Cloud&>();
        if (is_single(points)) {
          by_transform<float>(X_AB, points, with, own, cloud, is_new);
        } else {
          by_transform<double>(X_AB, points, with, own, cloud, is_new);
        }
        return out;
      },
      py::name("transform_cloud"), py::is_method(transform), py::arg("points"), py::kw_only(),
      py::arg("covariance") = false, py::arg("own") = py::none(), py::arg("out") = py::none(),
      "A cloud of points (N, 3) of the child, in the parent: a Cloud, in float32 or float64 as\n"
      "given. covariance: also compute one for each point. own: (3, 3), of each point's own "
      "error.\n"
      "out: a Cloud of as many points, of the same type, which is overwritten and returned: that "
      "is\n"
      "several times as fast for millions. Its arrays show the new points.");
}

}  // namespace tfdude::python
