#include "samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>

#include "tfdude/base/id.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "../numbers.hpp"
#include "typed_stamp.hpp"

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
  if (object.contains("stamp") && object.contains("stamp_ns")) {
    return wrong("stamp and stamp_ns are both given");
  }
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

// An object of JSON, each of whose keys is given once: of two, one would be lost.
Result<Json> parse_object(const std::string& line) {
  std::vector<std::set<std::string>> open;
  std::optional<std::string> twice;
  const auto note = [&](int /*depth*/, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) open.emplace_back();
    if (event == Json::parse_event_t::object_end) open.pop_back();
    if (event == Json::parse_event_t::key &&
        !open.back().insert(parsed.get<std::string>()).second) {
      twice = parsed.get<std::string>();
    }
    return true;
  };
  Json object = Json::parse(line, note, false);
  if (!object.is_object()) return wrong("not an object of JSON");
  if (twice) return wrong("key " + quote(*twice) + " is given twice");
  return object;
}

Result<EdgeUpdate> read_edge(const Json& object, const AngleUnit& angles) {
  if (!object.is_object() || !object.contains("edge") || !object["edge"].is_string()) {
    return wrong("an edge needs its frame: \"edge\": ID");
  }
  const auto id = object["edge"].get<std::string>();
  TransformSpec spec;
  const auto read = check_keys(object, {"edge", "xyz", "rpy", "quat", "matrix", "geodetic",
                                        "stddev", "cov", "covariance", "stamp", "stamp_ns"})
                        .and_then([&] { return read_numbers(object, "xyz", spec.xyz); })
                        .and_then([&] { return read_numbers(object, "rpy", spec.rpy); })
                        .and_then([&] { return read_numbers(object, "quat", spec.quat); })
                        .and_then([&] { return read_numbers(object, "matrix", spec.matrix); })
                        .and_then([&] { return read_numbers(object, "geodetic", spec.geodetic); })
                        .and_then([&] { return read_numbers(object, "stddev", spec.stddev); })
                        .and_then([&] { return read_numbers(object, "cov", spec.cov); });
  if (!read) return fail_at("edge " + quote(id), read.error());
  if (object.contains("covariance")) {
    if (!object["covariance"].is_string()) {
      return wrong("edge " + quote(id) + ": covariance must be unspecified or exact");
    }
    spec.covariance = object["covariance"].get<std::string>();
  }
  if (!spec.gives_translation() && !spec.gives_rotation())
    return wrong("edge " + quote(id) + " has no pose");
  auto X_PC = in_radians(std::move(spec), angles).build();
  if (!X_PC) return fail_at("edge " + quote(id), X_PC.error());
  return EdgeUpdate{id, *X_PC};
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

// The columns of CSV that are an array in JSON.
struct Group {
  const char* key;
  std::vector<std::string> columns;
};
const std::vector<Group>& groups() {
  static const std::vector<Group> all = {{"xyz", {"x", "y", "z"}},
                                         {"rpy", {"roll", "pitch", "yaw"}},
                                         {"quat", {"qx", "qy", "qz", "qw"}},
                                         {"stddev", {"sx", "sy", "sz", "srx", "sry", "srz"}}};
  return all;
}

// Adds a number of a column to an edge in JSON. @return false: no group has the column
bool add_number(Json& edge, const std::string& column, double number) {
  for (const Group& group : groups()) {
    const auto found = std::find(group.columns.begin(), group.columns.end(), column);
    if (found == group.columns.end()) continue;
    edge[group.key][static_cast<std::size_t>(found - group.columns.begin())] = number;
    return true;
  }
  return false;
}

// Names of joints may be any ids, but not what only a line of JSON or of values has.
Result<void> check_column(const std::string& column) {
  if (column.find_first_of("[{\"") == 0 || to_number(column)) {
    return wrong(quote(column) +
                 " is no name of a column: the first line is neither an object of "
                 "JSON nor the names of CSV");
  }
  return check_id(column, "the name of a column");
}

// All columns of a group are needed, since a value cannot be partial.
Result<void> check_columns(const std::vector<std::string>& columns) {
  const auto has = [&](const std::string& name) {
    return std::find(columns.begin(), columns.end(), name) != columns.end();
  };
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].empty()) return wrong("column " + std::to_string(i + 1) + " has no name");
    if (auto ok = check_column(columns[i]); !ok) return ok;
    if (std::count(columns.begin(), columns.end(), columns[i]) > 1) {
      return wrong("column " + quote(columns[i]) + " is given twice");
    }
  }
  if (has("stamp") && has("stamp_ns")) return wrong("stamp and stamp_ns are both given");
  if (!has("edge")) return {};
  Json edge;
  for (const std::string& column : columns) {
    const bool known = column == "edge" || column == "stamp" || column == "stamp_ns" ||
                       add_number(edge, column, 0);
    if (!known) return wrong("column " + quote(column) + " is not known beside \"edge\"");
  }
  for (const Group& group : groups()) {
    const auto there = std::count_if(group.columns.begin(), group.columns.end(), has);
    if (there != 0 && there != static_cast<std::ptrdiff_t>(group.columns.size())) {
      return wrong("of the columns " + group.columns.front() + " to " + group.columns.back() +
                   " some are missing");
    }
  }
  if (!has("x") && !has("roll") && !has("qx")) return wrong("no column of a pose beside \"edge\"");
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

Result<Sample> SampleReader::read_object(const Json& object) const {
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
  std::set<std::string> ids;
  for (const Json& one : object.value("edges", Json::array())) {
    auto edge = read_edge(one, angles_);
    if (!edge) return tl::unexpected(edge.error());
    if (one.contains("stamp") || one.contains("stamp_ns")) {
      return wrong("edge " + quote(edge->id) +
                   ": the stamp stands beside \"edges\", for all of them");
    }
    if (!ids.insert(edge->id).second) return wrong("edge " + quote(edge->id) + " is given twice");
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

Result<void> SampleReader::finish() const {
  if (!lacks_rows_) return {};
  return wrong(
      "no row follows the names of the columns; if this is none of CSV, a line is an object "
      "of JSON");
}

Result<Json> SampleReader::read_row(const std::string& line) const {
  Json object = Json::object();
  const std::vector<std::string> cells = split(line);
  if (cells.size() != columns_.size()) {
    return wrong(std::to_string(cells.size()) + " values for " + std::to_string(columns_.size()) +
                 " columns");
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string& column = columns_[i];
    const std::string& text = cells[i];
    if (column == "edge") {
      object["edge"] = text;
      continue;
    }
    const auto read = to_number(text);
    if (!read) return wrong(column + ": " + quote(text) + " is not a number");
    const double number = *read;
    const bool digits = text.find_first_not_of("0123456789") == std::string::npos;
    if (column == "stamp_ns" && digits) {
      object[column] = std::strtoull(text.c_str(), nullptr, 10);
    } else if (const auto exact = parse_stamp(text, Time{}); column == "stamp" && exact) {
      object["stamp_ns"] = static_cast<std::uint64_t>(nanoseconds(*exact));
    } else if (column == "stamp" || column == "stamp_ns") {
      object[column] = number;
    } else if (!edges_) {
      object["joints"][column] = number;
    } else {
      (void)add_number(object, column, number);
    }
  }
  return object;
}

Result<std::optional<Sample>> SampleReader::read(const std::string& line) {
  const std::size_t first = line.find_first_not_of(" \t\r");
  if (first == std::string::npos) return std::nullopt;
  const bool is_json = line[first] == '{';
  if (form_ == Form::kNoNames && !is_json) return wrong("the names of the columns were wrong");
  if (form_ == Form::kUndecided && !is_json) {
    const auto columns = split(line);
    if (auto ok = check_columns(columns); !ok) {
      form_ = Form::kNoNames;
      return tl::unexpected(ok.error());
    }
    form_ = Form::kCsv;
    columns_ = columns;
    edges_ = std::find(columns.begin(), columns.end(), "edge") != columns.end();
    lacks_rows_ = true;
    return std::nullopt;
  }
  lacks_rows_ = false;
  if (form_ != Form::kCsv) form_ = Form::kJson;
  auto object = form_ == Form::kJson ? parse_object(line) : read_row(line);
  if (!object) return tl::unexpected(std::move(object.error()));
  const auto sample = read_object(*object);
  if (!sample) return tl::unexpected(sample.error());
  return *sample;
}

}  // namespace tfdude::cli
