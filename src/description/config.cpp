#include "tfdude/description/config.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "description/config_frames.hpp"
#include "description/config_urdf.hpp"
#include "description/file_text.hpp"
#include "description/yaml_fields.hpp"
#include "description/yaml_quirks.hpp"

namespace tfdude {
namespace {

constexpr std::array<std::string_view, 6> kFileKeys = {"partition", "clock",  "covariance",
                                                       "history",   "frames", "urdf"};
constexpr std::array<std::string_view, 13> kFrameKeys = {
    "id",     "parent", "xyz",        "rpy",     "quat",        "matrix", "geodetic",
    "stddev", "cov",    "covariance", "history", "correlation", "sources"};
constexpr std::array<std::string_view, 8> kHistoryKeys = {
    "span", "count", "process_noise", "drifts", "moving", "max_ahead", "restart_after", "believed"};

// Reads the configuration file of a daemon.
class ConfigReader : public YamlFields {
 public:
  using YamlFields::YamlFields;

  [[nodiscard]] Result<Config> config(const YAML::Node& root) const;

 private:
  [[nodiscard]] Result<void> max_ahead(const Fields& entries, const std::string& what,
                                       std::chrono::nanoseconds& out) const;
  [[nodiscard]] Result<EdgeTiming> history(const Field& field, const std::string& place,
                                           EdgeTiming timing) const;
  [[nodiscard]] Result<Correlation> correlation(const Fields& entries,
                                                const std::string& place) const;
  [[nodiscard]] Result<CommonError> common_error(const std::string& source, const Field& field,
                                                 const std::string& place) const;
  [[nodiscard]] Result<FrameSpec> frame(const YAML::Node& node, const Config& config) const;
  [[nodiscard]] Result<void> frames(const Field& field, Config& config) const;
  [[nodiscard]] Result<void> urdfs(const Field& field, Config& config) const;
};

Result<void> ConfigReader::max_ahead(const Fields& entries, const std::string& what,
                                     std::chrono::nanoseconds& out) const {
  const auto found = entries.find("max_ahead");
  if (found == entries.end()) return {};
  const YAML::Node& value = found->second.value;
  if (value.IsScalar() && value.Scalar() == "none") {
    out = std::chrono::nanoseconds::max();
    return {};
  }
  std::optional<double> seconds;
  if (auto read = number(entries, "max_ahead", what, seconds); !read) return read;
  constexpr double kLongest = 1e9;
  if (!(*seconds >= 0 && *seconds <= kLongest)) {
    return error(Errc::kInvalidInput, found->second.mark,
                 what + ": max_ahead must be 0 to 1e9 seconds, or none");
  }
  out = std::chrono::nanoseconds(std::llround(*seconds * 1e9));
  return {};
}

// Keys that are left out keep their values of `timing`.
Result<EdgeTiming> ConfigReader::history(const Field& field, const std::string& place,
                                         EdgeTiming timing) const {
  const std::string what = place + ": history";
  const auto entries = fields(field.value, kHistoryKeys, what);
  if (!entries) return tl::unexpected(entries.error());
  std::optional<double> span;
  std::optional<double> count;
  std::optional<double> restart;
  std::optional<double> believed;
  std::optional<std::array<double, 6>> noise;
  const auto read = number(*entries, "span", what, span)
                        .and_then([&] { return number(*entries, "count", what, count); })
                        .and_then([&] { return max_ahead(*entries, what, timing.max_ahead); })
                        .and_then([&] { return number(*entries, "restart_after", what, restart); })
                        .and_then([&] { return number(*entries, "believed", what, believed); })
                        .and_then([&] { return numbers(*entries, "process_noise", what, noise); })
                        .and_then([&] { return flag(*entries, "drifts", what, timing.drifts); })
                        .and_then([&] { return flag(*entries, "moving", what, timing.moving); });
  if (!read) return tl::unexpected(read.error());
  const auto refuse = [&](const std::string& key, const std::string& why) {
    return error(Errc::kInvalidInput, entries->find(key)->second.mark, what + ": " + key + why);
  };
  constexpr double kLongest = 1e6;
  if (span && !(*span >= 1e-6 && *span <= kLongest)) {
    return refuse("span", " must be 1e-6 to 1e6 seconds");
  }
  constexpr double kMost = 1U << 24U;
  if (count && !(*count >= 2 && *count <= kMost && *count == std::floor(*count))) {
    return refuse("count", " must be a whole number from 2 to 16777216");
  }
  if (restart && !(*restart >= 0 && *restart <= kMost && *restart == std::floor(*restart))) {
    return refuse("restart_after", " must be a whole number from 0 to 16777216");
  }
  if (believed && !(*believed >= 0 && *believed <= kLongest)) {
    return refuse("believed", " must be 0 to 1e6 seconds");
  }
  if (believed) timing.believed = std::chrono::nanoseconds(std::llround(*believed * 1e9));
  if (restart) timing.restart_after = static_cast<std::size_t>(*restart);
  if (span) timing.span = std::chrono::nanoseconds(std::llround(*span * 1e9));
  if (count) timing.count = static_cast<std::size_t>(*count);
  if (noise) {
    const auto rate = Covariance::from_stddev(*noise);
    if (!rate) return refuse("process_noise", ": " + rate.error().message);
    timing.process_noise = *rate;
  }
  return timing;
}

// Reads a list of columns. Each is the edge's error for one standard deviation of one dimension of
// the source.
Result<CommonError> ConfigReader::common_error(const std::string& source, const Field& field,
                                               const std::string& place) const {
  const std::string what = place + ": source " + tfdude::quote(source);
  CommonError common_error{source, false, {}};
  if (!field.value.IsSequence() || field.value.size() == 0) {
    return error(Errc::kConfig, field.mark, what + " is not a list of columns of 6 numbers");
  }
  common_error.loading.resize(6, static_cast<Eigen::Index>(field.value.size()));
  for (std::size_t j = 0; j < field.value.size(); ++j) {
    const YAML::Node column = field.value[j];
    const std::string nth = what + "[" + std::to_string(j) + "]";
    if (!column.IsSequence() || column.size() != 6) {
      return error(Errc::kConfig, column.Mark(), nth + " is not a list of 6 numbers");
    }
    for (std::size_t i = 0; i < 6; ++i) {
      const auto value = number(column[i], nth + "[" + std::to_string(i) + "]");
      if (!value) return tl::unexpected(value.error());
      common_error.loading(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = *value;
    }
  }
  auto ok = check_common_errors({common_error}).and_then([&] { return check_new_source(source); });
  if (!ok) {
    return error(Errc::kInvalidInput, field.mark, place + ": " + ok.error().message);
  }
  if (!is_observed(common_error)) return common_error;
  return error(Errc::kInvalidInput, field.mark,
               what + ": names with this prefix are reserved for observations");
}

Result<Correlation> ConfigReader::correlation(const Fields& entries,
                                              const std::string& place) const {
  Correlation correlation;
  if (const auto found = entries.find("correlation"); found != entries.end()) {
    const auto said = text(found->second, place + ": correlation");
    if (!said) return tl::unexpected(said.error());
    if (*said != "unknown" && *said != "independent") {
      return error(Errc::kInvalidInput, found->second.mark,
                   place + ": correlation is neither unknown nor independent");
    }
    correlation.unknown = *said == "unknown";
  }
  if (const auto found = entries.find("sources"); found != entries.end()) {
    const auto sources = fields(found->second.value, place + ": sources");
    if (!sources) return tl::unexpected(sources.error());
    for (const auto& [source, field] : *sources) {
      auto one = common_error(source, field, place);
      if (!one) return tl::unexpected(std::move(one.error()));
      correlation.common_errors.push_back(*std::move(one));
    }
  }
  return correlation;
}

// `config` has the defaults, and the frames read so far.
Result<FrameSpec> ConfigReader::frame(const YAML::Node& node, const Config& config) const {
  const std::string nth = "frames[" + std::to_string(config.frames.size()) + "]";
  // Messages about a bad key also name the frame, if its id can be read.
  const auto is_id = [](const auto& entry) {
    return entry.first.IsScalar() && entry.first.Scalar() == "id";
  };
  std::string place = nth;
  if (node.IsMap()) {
    const auto found = std::find_if(node.begin(), node.end(), is_id);
    if (found != node.end() && found->second.IsScalar() &&
        check_new_id(found->second.Scalar(), "id")) {
      place = "frame " + tfdude::quote(found->second.Scalar());
    }
  }
  const auto entries = fields(node, kFrameKeys, place);
  if (!entries) return tl::unexpected(entries.error());
  if (entries->find("id") == entries->end()) {
    return error(Errc::kConfig, node.Mark(), place + ": id is missing");
  }
  FrameSpec spec;
  auto own_id = id(*entries, "id", place);
  if (!own_id) return tl::unexpected(own_id.error());
  spec.id = *std::move(own_id);
  if (entries->find("parent") != entries->end()) {
    auto parent = id(*entries, "parent", place);
    if (!parent) return tl::unexpected(parent.error());
    spec.parent = *std::move(parent);
  }
  auto X_PC = transform(node, *entries, place, config.covariance);
  if (!X_PC) return tl::unexpected(X_PC.error());
  spec.X_PC = *X_PC;
  if (spec.parent.empty()) {
    const char* needs = "needs parent: it places the frame in that one";
    if (auto ok = check_no_pose(*entries, place, needs); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
  }
  if (const auto found = entries->find("history"); found != entries->end()) {
    auto own = history(found->second, place, config.history);
    if (!own) return tl::unexpected(own.error());
    spec.timing = *own;
  }
  auto said = correlation(*entries, place);
  if (!said) return tl::unexpected(std::move(said.error()));
  spec.correlation = *std::move(said);
  return spec;
}

Result<Config> ConfigReader::config(const YAML::Node& root) const {
  const auto entries = fields(root, kFileKeys, "the file");
  if (!entries) return tl::unexpected(entries.error());
  Config config;
  if (const auto found = entries->find("partition"); found != entries->end()) {
    auto name = text(found->second, "partition");
    if (!name) return tl::unexpected(name.error());
    if (const auto ok = check_new_partition_name(*name); !ok) {
      return error(ok.error().code, found->second.mark, ok.error().message);
    }
    config.partition = *std::move(name);
  }
  if (const auto found = entries->find("clock"); found != entries->end()) {
    const auto kind = text(found->second, "clock");
    if (!kind) return tl::unexpected(kind.error());
    if (*kind != "system" && *kind != "external") {
      return error(Errc::kInvalidInput, found->second.mark,
                   "clock must be system or external, not " + tfdude::quote(*kind));
    }
    config.clock = *kind == "external" ? ClockKind::kExternal : ClockKind::kSystem;
  }
  if (const auto found = entries->find("covariance"); found != entries->end()) {
    const auto word = text(found->second, "covariance");
    if (!word) return tl::unexpected(word.error());
    const auto stated = covariance_named(*word);
    if (!stated) return error(stated.error().code, found->second.mark, stated.error().message);
    config.covariance = *stated;
  }
  if (const auto found = entries->find("history"); found != entries->end()) {
    auto timing = history(found->second, "the file", config.history);
    if (!timing) return tl::unexpected(timing.error());
    config.history = *timing;
    config.has_history = true;
  }
  if (const auto found = entries->find("frames"); found != entries->end()) {
    if (auto ok = frames(found->second, config); !ok) return tl::unexpected(ok.error());
  }
  if (const auto found = entries->find("urdf"); found != entries->end()) {
    if (auto ok = urdfs(found->second, config); !ok) return tl::unexpected(ok.error());
  }
  return config;
}

Result<void> ConfigReader::frames(const Field& field, Config& config) const {
  const YAML::Node& list = field.value;
  if (!list.IsSequence()) return error(Errc::kConfig, field.mark, "frames is not a list");
  std::unordered_map<std::string, int> line_of;
  for (const YAML::Node& node : list) {
    auto spec = frame(node, config);
    if (!spec) return tl::unexpected(spec.error());
    const auto [known, fresh] = line_of.emplace(spec->id, node.Mark().line + 1);
    if (!fresh) {
      return error(Errc::kInvalidInput, node.Mark(),
                   "frame " + tfdude::quote(spec->id) + ": id is taken by the frame in line " +
                       std::to_string(known->second));
    }
    config.frames.push_back(*std::move(spec));
    config.places.push_back(place(node.Mark()));
  }
  return check_no_cycle(config);
}

Result<void> ConfigReader::urdfs(const Field& field, Config& config) const {
  const YAML::Node& list = field.value;
  if (!list.IsSequence()) return error(Errc::kConfig, field.mark, "urdf is not a list");
  const UrdfFields reader(name(), std::filesystem::path(name()).parent_path().string(),
                          config.covariance);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const YAML::Node node = list[i];
    const std::string nth = "urdf[" + std::to_string(i) + "]";
    const auto part = reader.part(node, nth);
    if (!part) return tl::unexpected(part.error());
    if (auto ok = add_urdf(config, *part); !ok) {
      return error(ok.error().code, node.Mark(), nth + ": " + ok.error().message);
    }
  }
  return {};
}

}  // namespace

Result<Config> parse_config(const std::string& text, const std::string& name) {
  const ConfigReader reader(name);
  Result<Config> config;
  auto read = reader.read_document(text, [&](const YAML::Node& root) -> Result<void> {
    config = reader.config(root);
    return {};
  });
  if (!read) return tl::unexpected(std::move(read.error()));
  return config;
}

Result<Config> load_config(const std::string& path) {
  const auto text = read_text(path);
  if (!text) return tl::unexpected(text.error());
  return parse_config(*text, path);
}

}  // namespace tfdude
