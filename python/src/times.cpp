#include <cmath>
#include <limits>

#include "arguments.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

constexpr double kNanoseconds = 1e9;

[[noreturn]] void wrong_type(const char* what, const char* expected, py::handle value) {
  throw py::type_error(std::string(what) + " must be " + expected + ", not " +
                       std::string(py::str(py::type::handle_of(value).attr("__name__"))));
}

/// An instant or a duration beyond 292 years, or another number that is none.
[[noreturn]] void out_of_range(const char* what, py::handle value) {
  throw py::value_error(std::string(what) + " is out of range: " + std::string(py::str(value)));
}

std::int64_t nanoseconds_of(double seconds, const char* what) {
  const double ns = std::round(seconds * kNanoseconds);
  if (!(std::abs(ns) < 9.2e18)) out_of_range(what, py::float_(seconds));
  return static_cast<std::int64_t>(ns);
}

std::int64_t integer(py::handle value, const char* what) {
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
  if (!index && PyErr_ExceptionMatches(PyExc_TypeError) != 0) {
    PyErr_Clear();
    wrong_type(what, "an integer", value);
  }
  if (!index) throw py::error_already_set();
  int overflow = 0;
  const std::int64_t number = PyLong_AsLongLongAndOverflow(index.ptr(), &overflow);
  if (overflow != 0) out_of_range(what, index);
  if (number == -1 && PyErr_Occurred() != nullptr) throw py::error_already_set();
  return number;
}

/// Of a timedelta, exactly.
/// @param given  what it is of, for the message
std::int64_t of_timedelta(py::handle delta, py::handle given, const char* what) {
  constexpr std::int64_t kDay = 86400;
  constexpr std::int64_t kMostDays =
      std::numeric_limits<std::int64_t>::max() / kDay / 1'000'000'000;
  const std::int64_t days = integer(delta.attr("days"), what);
  // One less: of the last day only a part can be had.
  if (std::abs(days) >= kMostDays) out_of_range(what, given);
  return ((days * kDay + integer(delta.attr("seconds"), what)) * 1'000'000 +
          integer(delta.attr("microseconds"), what)) *
         1000;
}

py::object epoch() {
  const py::module_ datetime = py::module_::import("datetime");
  return datetime.attr("datetime")(1970, 1, 1, 0, 0, 0, 0, datetime.attr("timezone").attr("utc"));
}

}  // namespace

Time to_time(py::handle time, const char* what) {
  constexpr const char* kExpected = "int [ns], float [s] or datetime";
  if (PyLong_CheckExact(time.ptr())) return time_of(integer(time, what));
  if (PyFloat_Check(time.ptr())) return time_of(nanoseconds_of(time.cast<double>(), what));
  if (PyBool_Check(time.ptr()) || time.is_none()) wrong_type(what, kExpected, time);
  if (PyIndex_Check(time.ptr())) return time_of(integer(time, what));
  if (py::hasattr(time, "nanoseconds")) return time_of(integer(time.attr("nanoseconds"), what));
  if (py::isinstance(time, py::module_::import("datetime").attr("datetime"))) {
    if (time.attr("tzinfo").is_none()) {
      throw py::value_error(std::string(what) +
                            ": a datetime needs a time zone, such as timezone.utc");
    }
    return time_of(of_timedelta(time - epoch(), time, what));
  }
  wrong_type(what, kExpected, time);
}

std::optional<Time> to_stamp(py::handle time_or_none, const char* what) {
  if (time_or_none.is_none()) return std::nullopt;
  return to_time(time_or_none, what);
}

py::object from_stamp(std::optional<Time> stamp) {
  if (!stamp) return py::none();
  return py::int_(nanoseconds(*stamp));
}

py::object to_datetime(std::optional<Time> stamp) {
  if (!stamp) return py::none();
  const py::object timedelta = py::module_::import("datetime").attr("timedelta");
  return epoch() + timedelta(0, 0, nanoseconds(*stamp) / 1000);
}

std::chrono::nanoseconds to_duration(py::handle duration, const char* what) {
  if (!PyBool_Check(duration.ptr())) {
    const double seconds = PyFloat_AsDouble(duration.ptr());
    if (PyErr_Occurred() == nullptr) {
      return std::chrono::nanoseconds(nanoseconds_of(seconds, what));
    }
    const bool too_large = PyErr_ExceptionMatches(PyExc_OverflowError) != 0;
    PyErr_Clear();
    if (too_large) out_of_range(what, duration);
    if (py::hasattr(duration, "nanoseconds")) {
      return std::chrono::nanoseconds(integer(duration.attr("nanoseconds"), what));
    }
    if (py::isinstance(duration, py::module_::import("datetime").attr("timedelta"))) {
      return std::chrono::nanoseconds(of_timedelta(duration, duration, what));
    }
  }
  wrong_type(what, "a number [s] or timedelta", duration);
}

Milliseconds to_milliseconds(py::handle duration, const char* what) {
  // Infinity is what people write for "no limit".
  if (PyFloat_Check(duration.ptr()) && std::isinf(duration.cast<double>()) &&
      duration.cast<double>() > 0) {
    return Milliseconds::max();
  }
  return std::chrono::ceil<Milliseconds>(to_duration(duration, what));
}

double to_seconds(std::chrono::nanoseconds duration) {
  return static_cast<double>(duration.count()) / kNanoseconds;
}

Order to_order(int order) {
  if (order != 2 && order != 4) {
    throw py::value_error("order must be 2 or 4, not " + std::to_string(order));
  }
  return order == 2 ? Order::kSecond : Order::kFourth;
}

Query to_query(py::handle at, py::handle extrapolate, py::handle age_noise_until, int order,
               py::handle believed_at) {
  Query query;
  query.at = to_stamp(at, "at");
  query.extrapolate = not_negative(to_duration(extrapolate, "extrapolate"), "extrapolate");
  query.age_noise_until = to_stamp(age_noise_until, "age_noise_until");
  query.order = to_order(order);
  query.believed_at = to_stamp(believed_at, "believed_at");
  return query;
}

}  // namespace tfdude::python
