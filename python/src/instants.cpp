#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "arguments.hpp"
#include "arrays.hpp"
#include "many.hpp"

// Many instants in one argument.
namespace tfdude::python {
namespace {

/// Of datetime64: numpy does not tell if an instant cannot be counted in nanoseconds.
void check_years(const py::array& dates) {
  using Years = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
  const Years years(dates.attr("astype")("datetime64[Y]").attr("view")("int64"));  // from 1970
  for (py::ssize_t i = 0; i < years.size(); ++i) {
    const std::int64_t year = years.data()[i];
    if (year >= 1678 - 1970 && year <= 2261 - 1970) continue;
    const bool is_time = year != std::numeric_limits<std::int64_t>::min();  // how numpy has NaT
    throw py::value_error("instant " + std::to_string(i) +
                          (is_time ? " is out of range" : " is NaT: not a time"));
  }
}

[[noreturn]] void instant_out_of_range(std::size_t i) {
  throw py::value_error("instant " + std::to_string(i) + " is out of range");
}

/// @throws ValueError for a number that no instant has
void check_unsigned(const py::array& array) {
  const auto ns = py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>(array);
  for (py::ssize_t i = 0; i < ns.size(); ++i) {
    if (ns.data()[i] <= std::uint64_t{std::numeric_limits<std::int64_t>::max()}) continue;
    instant_out_of_range(static_cast<std::size_t>(i));
  }
}

/// The numbers of an array as instants; empty: it has others.
std::optional<std::vector<Time>> of_array(py::handle at, const char* what) {
  if (!py::isinstance<py::array>(at)) return std::nullopt;
  auto array = py::reinterpret_borrow<py::array>(at);
  if (array.ndim() != 1) {
    throw py::value_error(std::string(what) + " must have the shape (N,), not " +
                          std::string(py::str(array.attr("shape"))));
  }
  char kind = array.dtype().kind();
  const auto count = static_cast<std::size_t>(array.shape(0));
  std::vector<Time> instants(count);
  if (kind == 'M') {
    check_years(array);
    array = array.attr("astype")("datetime64[ns]").attr("view")("int64");
    kind = 'i';
  }
  if (kind == 'b') throw py::type_error(std::string(what) + " must be instants, not bools");
  if (kind == 'u') check_unsigned(array);
  if (kind == 'i' || kind == 'u') {
    const auto ns = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>(array);
    std::transform(ns.data(), ns.data() + count, instants.begin(),
                   [](std::int64_t t) { return time_of(t); });
    return instants;
  }
  if (kind != 'f') return std::nullopt;
  if (array.itemsize() < 8) {
    throw py::type_error(std::string(what) + " must be float64: " +
                         std::string(py::str(array.dtype())) + " is too coarse for an instant");
  }
  const auto seconds = Doubles(array);
  for (std::size_t i = 0; i < count; ++i) {
    const double ns = std::round(seconds.data()[i] * 1e9);
    if (!(std::abs(ns) < 9.2e18)) instant_out_of_range(i);
    instants[i] = time_of(static_cast<std::int64_t>(ns));
  }
  return instants;
}

}  // namespace

std::vector<Time> to_instants(py::handle at, const char* what) {
  if (auto instants = of_array(at, what)) return *std::move(instants);
  if (!py::isinstance<py::iterable>(at))
    throw py::type_error(std::string(what) + " must be an array of instants");
  std::vector<Time> instants;
  for (const py::handle one : py::reinterpret_borrow<py::iterable>(at)) {
    instants.push_back(to_time(one, "an instant"));
  }
  return instants;
}

bool is_many(py::handle at) {
  return py::isinstance<py::sequence>(at) ||
         (py::isinstance<py::array>(at) && py::reinterpret_borrow<py::array>(at).ndim() > 0);
}

std::vector<std::optional<Time>> to_stamps(py::handle at, bool& many, const char* what) {
  many = is_many(at);
  if (!many) return {to_stamp(at, what)};
  std::vector<std::optional<Time>> stamps;
  if (const auto instants = of_array(at, what)) {
    stamps.assign(instants->begin(), instants->end());
    return stamps;
  }
  for (const py::handle one : py::reinterpret_borrow<py::iterable>(at)) {
    stamps.push_back(to_stamp(one, "an instant"));
  }
  return stamps;
}

}  // namespace tfdude::python
