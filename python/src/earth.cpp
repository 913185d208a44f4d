#include "earth.hpp"

#include "tfdude/math/earth.hpp"

#include "arguments.hpp"
#include "arrays.hpp"

namespace tfdude::python {
namespace {

Transform fix(const Geodetic& place, py::handle covariance) {
  const Doubles rows = doubles(covariance, {3, 3}, "covariance");
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  return value_of(position_fix(place, Eigen::Map<const Rows>(rows.data())));
}

}  // namespace

void bind_earth(py::module_& module) {
  py::class_<Utm> utm(
      module, "Utm",
      "A place on a map of universal transverse Mercator; zone 0: universal polar stereographic.");
  py::class_<Geodetic> geodetic(
      module, "Geodetic",
      "A place on the ellipsoid of WGS84: latitude and longitude [deg], altitude above it [m].");
  geodetic
      .def(py::init([](double latitude, double longitude, double altitude) {
             const Geodetic place{latitude, longitude, altitude};
             check(check_geodetic(place));
             return place;
           }),
           py::arg("latitude"), py::arg("longitude"), py::arg("altitude") = 0.0)
      .def_static(
          "from_ecef",
          [](py::handle point) {
            const Geodetic place = geodetic_of(to_vector3(point, "point"));
            check(check_geodetic(place));
            return place;
          },
          py::arg("point"), "Of a point (3,) of an earth frame [m].")
      .def_readonly("latitude", &Geodetic::latitude)
      .def_readonly("longitude", &Geodetic::longitude)
      .def_readonly("altitude", &Geodetic::altitude)
      .def_property_readonly(
          "utm", [](const Geodetic& place) { return value_of(utm_of(place)); },
          "The same place on a map.")
      .def_property_readonly(
          "enu", [](const Geodetic& place) { return Transform::exact(value_of(enu_pose(place))); },
          "The pose of the axes east, north and up there, in an earth frame (ECEF). Exact.")
      .def("fix", &fix, py::arg("covariance"),
           "As `enu`, as a receiver of satellites measured it: covariance (3, 3) of east, north\n"
           "and up [m²]. Nothing is known of the rotation.");
  utm.def(py::init([](int zone, bool north, double easting, double northing, double altitude) {
            return Utm{zone, north, easting, northing, altitude};
          }),
          py::arg("zone"), py::arg("north"), py::arg("easting"), py::arg("northing"),
          py::arg("altitude") = 0.0)
      .def_readonly("zone", &Utm::zone, "1 to 60; 0: polar.")
      .def_readonly("north", &Utm::north)
      .def_readonly("easting", &Utm::easting, "[m]")
      .def_readonly("northing", &Utm::northing, "[m]")
      .def_readonly("altitude", &Utm::altitude, "[m]")
      .def_readonly("convergence", &Utm::convergence,
                    "How far the map's north is turned to the east of true north [rad].")
      .def_readonly("scale", &Utm::scale, "The length on the map of a metre.")
      .def_property_readonly(
          "geodetic", [](const Utm& place) { return value_of(geodetic_of(place)); },
          "The same place; convergence and scale are not used.");
  py::class_<GeodeticPose>(module, "GeodeticPose", "A frame, seen where it is on the Earth.")
      .def_readonly("place", &GeodeticPose::place)
      .def_readonly("utm", &GeodeticPose::utm)
      .def_readonly("X_NB", &GeodeticPose::X_NB,
                    "Its pose in the axes east, north and up there: a rotation, with covariance;\n"
                    "stddev_in_parent has the deviations to the east, to the north and up.");
}

}  // namespace tfdude::python
