#include "samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

#include "tfdude/base/id.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "../numbers.hpp"

namespace tfdude::cli {
namespace {

using Json = nlohmann::json;

tl::unexpected<Error> wrong(std::string message) {
  return fail(Errc::kInvalidInput, std::move(message));
}

Result<Time> stamp_of(double seconds) {
  constexpr double kLast = 9.2e9;
  if (!(seconds >= 0 && seconds < kLast)) return wrong("stamp is not within 0 and 9.2e9 s");
  return time_of(std::llround(seconds * 1e9));
}

Result<std::optional<Time>> stamp_of(const Json& object) {
  if (const auto ns = object.find("stamp_ns"); ns != object.end()) {
    if (!ns->is_number_unsigned() || ns->get<std::uint64_t>() > INT64_MAX) {
      return wrong("stamp_ns is not a whole number of nanoseconds");
    }
    return time_of(ns->get<std::int64_t>());
  }
  const auto stamp = object.find("stamp");
  if (stamp == object.end()) return std::nullopt;
  if (!stamp->is_number()) return wrong("stamp is not a number");
  return stamp_of(stamp->get<double>()).map([](Time at) { return std::optional<Time>(at); });
}

// Reads an array of numbers, if the object has it.
template <std::size_t N>
Result<void> read_numbers(const Json& object, const char* key,
                          std::optional<std::array<double, N>>& numbers) {
  const auto found = object.find(key);
  if (found == object.end()) return {};
  const bool numeric =
      found->is_array() && found->size() == N &&
      std::all_of(found->begin(), found->end(), [](const Json& one) { return one.is_number(); });
  if (!numeric)
    return wrong(std::string(key) + " is not an array of " + std::to_string(N) + " numbers");
  numbers = found->get<std::array<double, N>>();
  return {};
}

// So that a misspelt key is not taken for a part that was left out.
Result<void> check_keys(const Json& object, std::initializer_list<const char*> known) {
  for (const auto& item : object.items()) {
    const auto same = [&](const char* one) { return item.key() == one; };
    if (std::none_of(known.begin(), known.end(), same)) {
      return wrong("key " + quote(item.key()) + " is not known here");
    }
  }
  return {};
}

Result<EdgeUpdate> finish_edge(const std::string& id, TransformSpec spec, const AngleUnit& angles) {
  auto X_PC = in_radians(std::move(spec), angles).build();
  if (!X_PC) return fail_at("edge " + quote(id), X_PC.error());
  return EdgeUpdate{id, *X_PC};
}

Result<EdgeUpdate> read_edge(const Json& object, const AngleUnit& angles) {
  if (!object.is_object() || !object.contains("edge") || !object["edge"].is_string()) {
    return wrong("an edge needs its frame: \"edge\": ID");
  }
  const auto id = object["edge"].get<std::string>();
  TransformSpec spec;
  const auto read = check_keys(object, {"edge", "xyz", "rpy", "quat", "matrix", "stddev", "cov",
                                        "covariance", "stamp", "stamp_ns"})
                        .and_then([&] { return read_numbers(object, "xyz", spec.xyz); })
                        .and_then([&] { return read_numbers(object, "rpy", spec.rpy); })
                        .and_then([&] { return read_numbers(object, "quat", spec.quat); })
                        .and_then([&] { return read_numbers(object, "matrix", spec.matrix); })
                        .and_then([&] { return read_numbers(object, "stddev", spec.stddev); })
                        .and_then([&] { return read_numbers(object, "cov", spec.cov); });
  if (!read) return fail_at("edge " + quote(id), read.error());
  if (object.contains("covariance")) {
    if (!object["covariance"].is_string()) {
      return wrong("edge " + quote(id) + ": covariance must be unspecified or exact");
    }
    spec.covariance = object["covariance"].get<std::string>();
  }
  if (!spec.xyz && !spec.gives_rotation()) return wrong("edge " + quote(id) + " has no pose");
  return finish_edge(id, std::move(spec), angles);
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    std::string cell = line.substr(at, end - at);
    const std::size_t first = cell.find_first_not_of(" \t\r");
    cell = first == std::string::npos
               ? ""
               : cell.substr(first, cell.find_last_not_of(" \t\r") - first + 1);
    cells.push_back(std::move(cell));
    at = end + 1;
  }
  return cells;
}

// The place in a pose that a column of CSV fills; null if it is none of a pose.
double* place_of(const std::string& column, TransformSpec& spec) {
  const auto in = [&](auto& field, std::initializer_list<const char*> names) -> double* {
    const auto found = std::find(names.begin(), names.end(), column);
    if (found == names.end()) return nullptr;
    if (!field) field.emplace();
    return &(*field)[static_cast<std::size_t>(found - names.begin())];
  };
  for (double* place : {in(spec.xyz, {"x", "y", "z"}), in(spec.rpy, {"roll", "pitch", "yaw"}),
                        in(spec.quat, {"qx", "qy", "qz", "qw"}),
                        in(spec.stddev, {"sx", "sy", "sz", "srx", "sry", "srz"})}) {
    if (place != nullptr) return place;
  }
  return nullptr;
}

// All columns of a group are needed, since a value cannot be partial.
Result<void> check_columns(const std::vector<std::string>& columns) {
  const auto has = [&](const char* name) {
    return std::find(columns.begin(), columns.end(), name) != columns.end();
  };
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].empty()) return wrong("column " + std::to_string(i + 1) + " has no name");
    if (std::count(columns.begin(), columns.end(), columns[i]) > 1) {
      return wrong("column " + quote(columns[i]) + " is given twice");
    }
  }
  if (!has("edge")) return {};
  TransformSpec spec;
  for (const std::string& column : columns) {
    const bool known = column == "edge" || column == "stamp" || column == "stamp_ns" ||
                       place_of(column, spec) != nullptr;
    if (!known) return wrong("column " + quote(column) + " is not known beside \"edge\"");
  }
  const std::initializer_list<std::initializer_list<const char*>> groups = {
      {"x", "y", "z"},
      {"roll", "pitch", "yaw"},
      {"qx", "qy", "qz", "qw"},
      {"sx", "sy", "sz", "srx", "sry", "srz"}};
  for (const auto& group : groups) {
    const auto there = std::count_if(group.begin(), group.end(), has);
    if (there != 0 && there != static_cast<std::ptrdiff_t>(group.size())) {
      return wrong(std::string("of the columns ") + *group.begin() + " to " + *(group.end() - 1) +
                   " some are missing");
    }
  }
  if (!spec.xyz && !spec.gives_rotation()) return wrong("no column of a pose beside \"edge\"");
  return {};
}

}  // namespace

Result<double> SampleReader::position(const std::string& joint, double typed) const {
  if (angles_.per_radian == 1) return typed;
  const auto known = joints_.find(joint);
  if (known == joints_.end()) {
    return fail(Errc::kUnknownJoint, "no joint " + quote(joint) + ": its unit is not known");
  }
  return known->second.type == JointType::kPrismatic ? typed : typed / angles_.per_radian;
}

Result<Sample> SampleReader::read_json(const std::string& line) const {
  const Json object = Json::parse(line, nullptr, false);
  if (!object.is_object()) return wrong("not an object of JSON");
  Sample sample;
  const auto stamp = stamp_of(object);
  if (!stamp) return tl::unexpected(stamp.error());
  sample.stamp = *stamp;
  if (object.contains("edge")) {
    auto edge = read_edge(object, angles_);
    if (!edge) return tl::unexpected(edge.error());
    sample.edges.push_back(*std::move(edge));
    return sample;
  }
  if (auto ok = check_keys(object, {"edges", "joints", "stddev", "stamp", "stamp_ns"}); !ok) {
    return tl::unexpected(ok.error());
  }
  for (const Json& one : object.value("edges", Json::array())) {
    auto edge = read_edge(one, angles_);
    if (!edge) return tl::unexpected(edge.error());
    sample.edges.push_back(*std::move(edge));
  }
  const Json joints = object.value("joints", Json::object());
  if (!joints.is_object()) return wrong("joints is not an object of names and positions");
  const Json stddev = object.value("stddev", Json());
  if (!stddev.is_null() && !stddev.is_number()) return wrong("stddev is not a number");
  for (const auto& item : joints.items()) {
    if (!item.value().is_number()) {
      return wrong("joint " + quote(item.key()) + ": the position is not a number");
    }
    const auto at = position(item.key(), item.value().get<double>());
    if (!at) return tl::unexpected(at.error());
    sample.joints.push_back({item.key(), *at});
    if (stddev.is_null()) continue;
    const double deviation = *position(item.key(), stddev.get<double>());
    if (!(deviation >= 0)) return wrong("stddev is negative");
    sample.joints.back().variance = deviation * deviation;
  }
  if (sample.edges.empty() && sample.joints.empty()) return wrong("neither an edge nor a joint");
  return sample;
}

Result<Sample> SampleReader::read_row(const std::string& line) const {
  const std::vector<std::string> cells = split(line);
  if (cells.size() != columns_.size()) {
    return wrong(std::to_string(cells.size()) + " values for " + std::to_string(columns_.size()) +
                 " columns");
  }
  Sample sample;
  std::string edge;
  TransformSpec spec;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string& column = columns_[i];
    if (column == "edge") {
      edge = cells[i];
      continue;
    }
    if (!is_number(cells[i])) return wrong(column + ": " + quote(cells[i]) + " is not a number");
    const double value = std::strtod(cells[i].c_str(), nullptr);
    if (column == "stamp_ns") {
      if (cells[i].find_first_not_of("0123456789") != std::string::npos || value > 9.2e18) {
        return wrong("stamp_ns is not a whole number of nanoseconds");
      }
      sample.stamp = time_of(std::strtoll(cells[i].c_str(), nullptr, 10));
    } else if (column == "stamp") {
      const auto stamp = stamp_of(value);
      if (!stamp) return tl::unexpected(stamp.error());
      sample.stamp = *stamp;
    } else if (edges_) {
      *place_of(column, spec) = value;
    } else {
      const auto at = position(column, value);
      if (!at) return tl::unexpected(at.error());
      sample.joints.push_back({column, *at});
    }
  }
  if (!edges_) {
    if (sample.joints.empty()) return wrong("neither an edge nor a joint");
    return sample;
  }
  auto update = finish_edge(edge, std::move(spec), angles_);
  if (!update) return tl::unexpected(update.error());
  sample.edges.push_back(*std::move(update));
  return sample;
}

Result<std::optional<Sample>> SampleReader::read(const std::string& line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  if (first == std::string::npos) return std::nullopt;
  if (form_ == Form::kUndecided && line[first] != '{') {
    const auto columns = split(line);
    if (auto ok = check_columns(columns); !ok) return tl::unexpected(ok.error());
    form_ = Form::kCsv;
    columns_ = columns;
    edges_ = std::find(columns.begin(), columns.end(), "edge") != columns.end();
    return std::nullopt;
  }
  if (form_ == Form::kUndecided) form_ = Form::kJson;
  const auto sample = form_ == Form::kJson ? read_json(line) : read_row(line);
  if (!sample) return tl::unexpected(sample.error());
  return *sample;
}

}  // namespace tfdude::cli
