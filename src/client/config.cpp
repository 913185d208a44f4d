#include "tfdude/client/config.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "client/yaml_fields.hpp"
#include "client/yaml_quirks.hpp"

namespace tfdude {
namespace {

// Longest file that is read: room for half a million frames, and an end to /dev/zero.
constexpr std::size_t kMaxFileBytes = std::size_t{64} << 20U;

constexpr std::array<std::string_view, 3> kFileKeys = {"partition", "history", "frames"};
constexpr std::array<std::string_view, 10> kFrameKeys = {
    "id", "parent", "xyz", "rpy", "quat", "stddev", "cov", "history", "correlation", "sources"};
constexpr std::array<std::string_view, 4> kHistoryKeys = {"span", "count", "process_noise",
                                                          "moving"};

// The key whose line a complaint of TransformSpec::build() belongs to.
std::string_view blamed_key(const std::string& message, const TransformSpec& spec) {
  const auto starts = [&](std::string_view word) { return message.rfind(word, 0) == 0; };
  if (starts("translation")) return "xyz";
  if (starts("rpy")) return "rpy";
  if (starts("rotation")) return "quat";
  if (starts("stddev")) return "stddev";
  if (starts("covariance")) return spec.cov ? "cov" : "stddev";
  return {};
}

// Reads what a daemon's file may hold.
class Reader : public YamlFields {
 public:
  using YamlFields::YamlFields;

  [[nodiscard]] Result<Config> config(const YAML::Node& root) const;

 private:
  [[nodiscard]] Result<EdgeTiming> history(const Field& field, const std::string& place,
                                           EdgeTiming timing) const;
  [[nodiscard]] Result<Correlation> correlation(const Fields& fields,
                                                const std::string& place) const;
  [[nodiscard]] Result<Share> share(const std::string& source, const Field& field,
                                    const std::string& place) const;
  [[nodiscard]] Result<FrameSpec> frame(const YAML::Node& node, std::size_t index,
                                        const EdgeTiming& timing) const;
  [[nodiscard]] Result<void> check_no_cycle(const YAML::Node& list,
                                            const std::vector<FrameSpec>& frames) const;
  [[nodiscard]] Result<std::string> id(const Fields& fields, std::string_view key,
                                       const std::string& place) const;
  [[nodiscard]] Result<Transform> transform(const YAML::Node& node, const Fields& fields,
                                            const std::string& place) const;
};

Result<std::string> Reader::id(const Fields& fields, std::string_view key,
                               const std::string& place) const {
  const Field& field = fields.find(key)->second;
  auto value = text(field, place + ": " + std::string(key));
  if (!value) return value;
  if (const auto ok = check_id(*value, key); !ok) {
    return error(ok.error().code, field.mark, place + ": " + ok.error().message);
  }
  return value;
}

Result<Transform> Reader::transform(const YAML::Node& node, const Fields& fields,
                                    const std::string& place) const {
  TransformSpec spec;
  const auto read = numbers(fields, "xyz", place, spec.xyz)
                        .and_then([&] { return numbers(fields, "rpy", place, spec.rpy); })
                        .and_then([&] { return numbers(fields, "quat", place, spec.quat); })
                        .and_then([&] { return numbers(fields, "stddev", place, spec.stddev); })
                        .and_then([&] { return numbers(fields, "cov", place, spec.cov); });
  if (!read) return tl::unexpected(read.error());
  auto X_PC = spec.build();
  if (X_PC) return X_PC;
  const std::string& message = X_PC.error().message;
  const std::string_view key = blamed_key(message, spec);
  const auto field = fields.find(key);
  const bool named = message.rfind(std::string(key) + "[", 0) == 0 ||
                     message.find("both given") != std::string::npos;
  return error(X_PC.error().code, field == fields.end() ? node.Mark() : field->second.mark,
               place + ": " + (named ? "" : std::string(key) + ": ") + message);
}

// What is left out is as in `timing`.
Result<EdgeTiming> Reader::history(const Field& field, const std::string& place,
                                   EdgeTiming timing) const {
  const std::string what = place + ": history";
  const auto entries = fields(field.value, kHistoryKeys, what);
  if (!entries) return tl::unexpected(entries.error());
  std::optional<double> span;
  std::optional<double> count;
  std::optional<std::array<double, 6>> noise;
  const auto read = number(*entries, "span", what, span)
                        .and_then([&] { return number(*entries, "count", what, count); })
                        .and_then([&] { return numbers(*entries, "process_noise", what, noise); });
  if (!read) return tl::unexpected(read.error());
  const auto refuse = [&](const std::string& key, const std::string& why) {
    return error(Errc::kInvalidInput, entries->find(key)->second.mark, what + ": " + key + why);
  };
  constexpr double kLongest = 1e6;
  if (span && !(*span >= 1e-6 && *span <= kLongest)) {
    return refuse("span", " is not within 1e-6 and 1e6 seconds");
  }
  constexpr double kMost = 1U << 24U;
  if (count && !(*count >= 2 && *count <= kMost && *count == std::floor(*count))) {
    return refuse("count", " is not a whole number within 2 and 16777216");
  }
  if (span) timing.span = std::chrono::nanoseconds(std::llround(*span * 1e9));
  if (count) timing.count = static_cast<std::size_t>(*count);
  if (noise) {
    const auto rate = Covariance::from_stddev(*noise);
    if (!rate) return refuse("process_noise", ": " + rate.error().message);
    timing.process_noise = *rate;
  }
  if (const auto moving = entries->find("moving"); moving != entries->end()) {
    const std::string& said = moving->second.value.Scalar();
    if (said != "true" && said != "false") return refuse("moving", " is neither true nor false");
    timing.moving = said == "true";
  }
  return timing;
}

// A list of columns, each the error for one standard deviation of one dimension of the source.
Result<Share> Reader::share(const std::string& source, const Field& field,
                            const std::string& place) const {
  const std::string what = place + ": source " + tfdude::quote(source);
  Share share{source, false, {}};
  if (!field.value.IsSequence() || field.value.size() == 0) {
    return error(Errc::kConfig, field.mark, what + " is not a list of columns of 6 numbers");
  }
  share.factor.resize(6, static_cast<Eigen::Index>(field.value.size()));
  for (std::size_t j = 0; j < field.value.size(); ++j) {
    const YAML::Node column = field.value[j];
    const std::string nth = what + "[" + std::to_string(j) + "]";
    if (!column.IsSequence() || column.size() != 6) {
      return error(Errc::kConfig, column.Mark(), nth + " is not a list of 6 numbers");
    }
    for (std::size_t i = 0; i < 6; ++i) {
      const auto value = number(column[i], nth + "[" + std::to_string(i) + "]");
      if (!value) return tl::unexpected(value.error());
      share.factor(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = *value;
    }
  }
  if (auto ok = check_shares({share}); !ok) {
    return error(Errc::kInvalidInput, field.mark, place + ": " + ok.error().message);
  }
  if (!is_observed(share)) return share;
  return error(Errc::kInvalidInput, field.mark, what + ": such names are given to observations");
}

Result<Correlation> Reader::correlation(const Fields& entries, const std::string& place) const {
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
      auto one = share(source, field, place);
      if (!one) return tl::unexpected(std::move(one.error()));
      correlation.shares.push_back(*std::move(one));
    }
  }
  return correlation;
}

Result<FrameSpec> Reader::frame(const YAML::Node& node, std::size_t index,
                                const EdgeTiming& timing) const {
  const std::string nth = "frames[" + std::to_string(index) + "]";
  // The message of a bad key names the frame too, where the id can be made out.
  const auto is_id = [](const auto& entry) {
    return entry.first.IsScalar() && entry.first.Scalar() == "id";
  };
  std::string place = nth;
  if (node.IsMap()) {
    const auto found = std::find_if(node.begin(), node.end(), is_id);
    if (found != node.end() && found->second.IsScalar() && check_id(found->second.Scalar(), "id")) {
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
  auto X_PC = transform(node, *entries, place);
  if (!X_PC) return tl::unexpected(X_PC.error());
  spec.X_PC = *X_PC;
  if (const auto found = entries->find("history"); found != entries->end()) {
    auto own = history(found->second, place, timing);
    if (!own) return tl::unexpected(own.error());
    spec.timing = *own;
  }
  auto ties = correlation(*entries, place);
  if (!ties) return tl::unexpected(std::move(ties.error()));
  spec.correlation = *std::move(ties);
  return spec;
}

// Each frame climbs until where another has been that found its root.
Result<void> Reader::check_no_cycle(const YAML::Node& list,
                                    const std::vector<FrameSpec>& frames) const {
  std::unordered_map<std::string_view, std::size_t> index;
  for (std::size_t i = 0; i < frames.size(); ++i) index.emplace(frames[i].id, i);
  constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> visitor(frames.size(), kNobody);
  for (std::size_t start = 0; start < frames.size(); ++start) {
    std::size_t here = start;
    while (visitor[here] == kNobody) {
      visitor[here] = start;
      const auto parent = index.find(frames[here].parent);
      if (parent == index.end()) break;
      if (visitor[parent->second] == start) {
        return error(Errc::kInvalidInput, list[here].Mark(),
                     "frame " + tfdude::quote(frames[here].id) + ": parent " +
                         tfdude::quote(frames[here].parent) +
                         " is the frame itself or lies below it");
      }
      here = parent->second;
    }
  }
  return {};
}

Result<Config> Reader::config(const YAML::Node& root) const {
  const auto entries = fields(root, kFileKeys, "the file");
  if (!entries) return tl::unexpected(entries.error());
  Config config;
  if (const auto found = entries->find("partition"); found != entries->end()) {
    auto name = text(found->second, "partition");
    if (!name) return tl::unexpected(name.error());
    if (const auto ok = check_partition_name(*name); !ok) {
      return error(ok.error().code, found->second.mark, ok.error().message);
    }
    config.partition = *std::move(name);
  }
  if (const auto found = entries->find("history"); found != entries->end()) {
    auto timing = history(found->second, "the file", config.history);
    if (!timing) return tl::unexpected(timing.error());
    config.history = *timing;
  }
  const auto found = entries->find("frames");
  if (found == entries->end()) return config;
  const YAML::Node& list = found->second.value;
  if (!list.IsSequence()) return error(Errc::kConfig, found->second.mark, "frames is not a list");
  std::unordered_map<std::string, int> line_of;
  for (const YAML::Node& node : list) {
    auto spec = frame(node, config.frames.size(), config.history);
    if (!spec) return tl::unexpected(spec.error());
    const auto [known, fresh] = line_of.emplace(spec->id, node.Mark().line + 1);
    if (!fresh) {
      return error(Errc::kInvalidInput, node.Mark(),
                   "frame " + tfdude::quote(spec->id) + ": id is taken by the frame in line " +
                       std::to_string(known->second));
    }
    config.frames.push_back(*std::move(spec));
  }
  if (auto ok = check_no_cycle(list, config.frames); !ok) return tl::unexpected(ok.error());
  return config;
}

}  // namespace

Result<Config> parse_config(const std::string& text, const std::string& name) {
  const Reader reader(name);
  if (auto ok = check_bytes(name, text); !ok) return tl::unexpected(ok.error());
  try {
    const YAML::Node document = YAML::Load(text);
    if (const auto second = second_document(text)) {
      return reader.error(Errc::kConfig, *second, "holds more than one YAML document");
    }
    if (document.IsNull()) return fail(Errc::kConfig, name + ": is empty");
    return reader.config(document);
  } catch (const YAML::Exception& e) {
    return reader.error(Errc::kConfig, e.mark, "not YAML: " + printable(e.msg));
  } catch (const std::exception& e) {
    return fail(Errc::kConfig, name + ": " + e.what());
  }
}

Result<Config> load_config(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return fail(Errc::kConfig, path + ": is a directory");
  }
  const auto reason = [] { return std::generic_category().message(errno); };
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(Errc::kConfig, path + ": cannot be opened: " + reason());
  std::string text;
  std::array<char, 65536> block{};
  while (file) {
    file.read(block.data(), block.size());
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMaxFileBytes) return fail(Errc::kConfig, path + ": is longer than 64 MiB");
  }
  if (file.bad()) return fail(Errc::kConfig, path + ": cannot be read: " + reason());
  return parse_config(text, path);
}

}  // namespace tfdude
