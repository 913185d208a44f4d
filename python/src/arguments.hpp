#pragma once

#include <optional>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/query.hpp"

// Conversions between the arguments of Python and those of the library. Each throws what Python
// expects (TypeError, ValueError, an exception of tfdude), and needs the GIL.
namespace tfdude::python {

namespace py = pybind11;

/// The exception of an error (tfdude/_errors.py).
[[nodiscard]] py::object exception_of(const Error& error);
/// Raises it.
[[noreturn]] void raise(const Error& error);

/// The value of a result; raises its error.
template <class T>
T value_of(Result<T>&& result) {
  if (!result) raise(result.error());
  return *std::move(result);
}
inline void check(const Result<void>& result) {
  if (!result) raise(result.error());
}

/// An instant: int [ns], float [s], datetime with a time zone, or an object with `nanoseconds`.
/// @param what  its name in messages
[[nodiscard]] Time to_time(py::handle time, const char* what);
[[nodiscard]] std::optional<Time> to_stamp(py::handle time_or_none, const char* what);
/// As an int [ns]; None if absent.
[[nodiscard]] py::object from_stamp(std::optional<Time> stamp);
/// datetime in UTC, to microseconds; None if absent.
[[nodiscard]] py::object to_datetime(std::optional<Time> stamp);

/// A duration: number [s], timedelta, or an object with `nanoseconds`.
/// @param what  its name in messages
[[nodiscard]] std::chrono::nanoseconds to_duration(py::handle duration, const char* what);
[[nodiscard]] Milliseconds to_milliseconds(py::handle duration, const char* what);
[[nodiscard]] double to_seconds(std::chrono::nanoseconds duration);

/// What a covariance is given as: None or "unspecified", "exact", 6x6, or 21 of the upper triangle.
[[nodiscard]] StatedCovariance to_covariance(py::handle covariance,
                                             const char* name = "covariance");

/// Of 2 or 4.
[[nodiscard]] Order to_order(int order);
/// A query; `order` is 2 or 4.
[[nodiscard]] Query to_query(py::handle at, py::handle extrapolate, py::handle age_noise_until,
                             int order, py::handle believed_at = py::none());

}  // namespace tfdude::python
