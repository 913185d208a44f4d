#include "config.hpp"

#include <array>
#include <filesystem>
#include <string_view>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "description/file_text.hpp"
#include "description/yaml_fields.hpp"

namespace tfdude::ros {
namespace {

using Keys = std::string_view;

class Reader : public YamlFields {
 public:
  using YamlFields::YamlFields;

  [[nodiscard]] Result<void> read(const YAML::Node& root, Settings& settings) const;

 private:
  using Section = Result<void> (Reader::*)(const YAML::Node& node, Settings& settings) const;

  [[nodiscard]] Result<void> tf_in(const YAML::Node& node, Settings& settings) const;
  [[nodiscard]] Result<void> tf_out(const YAML::Node& node, Settings& settings) const;
  [[nodiscard]] Result<void> joints_in(const YAML::Node& node, Settings& settings) const;
  [[nodiscard]] Result<void> joints_out(const YAML::Node& node, Settings& settings) const;
  [[nodiscard]] Result<void> description_in(const YAML::Node& node, Settings& settings) const;
  [[nodiscard]] Result<void> description_out(const YAML::Node& node, Settings& settings) const;
  [[nodiscard]] Result<void> poses_in(const YAML::Node& node, Settings& settings) const;
  [[nodiscard]] Result<void> poses_out(const YAML::Node& node, Settings& settings) const;

  [[nodiscard]] Result<void> words(const Fields& fields, std::string_view key,
                                   const std::string& place, std::string& out) const;
  [[nodiscard]] Result<void> list(const Fields& fields, std::string_view key,
                                  const std::string& place, std::vector<std::string>& out) const;
  [[nodiscard]] Result<void> patterns(const Fields& fields, std::string_view key,
                                      const std::string& place, Patterns& out) const;
  [[nodiscard]] Result<void> covariance(const YAML::Node& node, const Fields& fields,
                                        const std::string& place, StatedCovariance& out) const;
  /// A number within a range, which the error names. Without the key, `out` stays as it is.
  /// @tparam Number  double or std::optional<double>
  template <class Number>
  [[nodiscard]] Result<void> within(const Fields& fields, std::string_view key,
                                    const std::string& place, double least, double most,
                                    Number& out) const;
  [[nodiscard]] Result<void> is_odometry(const YAML::Node& node, const std::string& place,
                                         const std::string& type, bool& out) const;
  /// An entry that must be there.
  [[nodiscard]] Result<void> require(const YAML::Node& node, const Fields& fields,
                                     std::string_view key, const std::string& place) const;
};

constexpr double kMaxRate = 1e6;
constexpr double kMaxStddev = 1e9;

Result<void> Reader::words(const Fields& fields, std::string_view key, const std::string& place,
                           std::string& out) const {
  const auto found = fields.find(key);
  if (found == fields.end()) return {};
  auto value = text(found->second, place + ": " + found->first);
  if (!value) return tl::unexpected(std::move(value.error()));
  out = *std::move(value);
  return {};
}

Result<void> Reader::list(const Fields& fields, std::string_view key, const std::string& place,
                          std::vector<std::string>& out) const {
  const auto found = fields.find(key);
  if (found == fields.end()) return {};
  const std::string what = place + ": " + found->first;
  if (!found->second.value.IsSequence()) {
    return error(Errc::kConfig, found->second.mark, what + " is not a list");
  }
  out.clear();
  for (const YAML::Node& one : found->second.value) {
    auto value = text({one, one.Mark()}, what);
    if (!value) return tl::unexpected(std::move(value.error()));
    out.push_back(*std::move(value));
  }
  return {};
}

Result<void> Reader::patterns(const Fields& fields, std::string_view key, const std::string& place,
                              Patterns& out) const {
  std::vector<std::string> texts;
  if (auto ok = list(fields, key, place, texts); !ok) return ok;
  out = Patterns(std::move(texts));
  return {};
}

Result<void> Reader::covariance(const YAML::Node& node, const Fields& fields,
                                const std::string& place, StatedCovariance& out) const {
  const auto X = transform(node, fields, place, out);
  if (!X) return tl::unexpected(X.error());
  out = X->covariance;
  return {};
}

template <class Number>
Result<void> Reader::within(const Fields& fields, std::string_view key, const std::string& place,
                            double least, double most, Number& out) const {
  std::optional<double> value;
  if (auto ok = number(fields, key, place, value); !ok) return ok;
  if (!value) return {};
  if (*value >= least && *value <= most) {
    out = *value;
    return {};
  }
  return error(Errc::kInvalidInput, fields.find(key)->second.mark,
               place + ": " + std::string(key) + " is not within " + number_text(least) + " and " +
                   number_text(most));
}

Result<void> Reader::require(const YAML::Node& node, const Fields& fields, std::string_view key,
                             const std::string& place) const {
  if (fields.find(key) != fields.end()) return {};
  return error(Errc::kConfig, node.Mark(), place + ": " + std::string(key) + " is missing");
}

Result<void> Reader::tf_in(const YAML::Node& node, Settings& settings) const {
  // "tf_in: false" instead of a mapping.
  if (node.IsScalar() && node.Scalar() == "false") {
    settings.frames_in.reset();
    return {};
  }
  constexpr std::array<Keys, 5> kKeys = {"frames", "except", "stddev", "cov", "covariance"};
  const auto entries = fields(node, kKeys, "tf_in");
  if (!entries) return tl::unexpected(entries.error());
  ImportSettings in;
  auto ok = patterns(*entries, "frames", "tf_in", in.frames.include)
                .and_then([&] { return patterns(*entries, "except", "tf_in", in.frames.exclude); })
                .and_then([&] { return covariance(node, *entries, "tf_in", in.covariance); });
  settings.frames_in = std::move(in);
  return ok;
}

Result<void> Reader::tf_out(const YAML::Node& node, Settings& settings) const {
  constexpr std::array<Keys, 3> kKeys = {"partitions", "frames", "rate"};
  const auto entries = fields(node, kKeys, "tf_out");
  if (!entries) return tl::unexpected(entries.error());
  ExportSettings out;
  auto ok =
      patterns(*entries, "partitions", "tf_out", out.partitions)
          .and_then([&] { return patterns(*entries, "frames", "tf_out", out.frames); })
          .and_then([&] { return within(*entries, "rate", "tf_out", 0, kMaxRate, out.rate); });
  settings.frames_out = std::move(out);
  return ok;
}

Result<void> Reader::joints_in(const YAML::Node& node, Settings& settings) const {
  constexpr std::array<Keys, 5> kKeys = {"stddev", "stddev_of", "joints", "except", "partition"};
  const auto entries = fields(node, kKeys, "joints_in");
  if (!entries) return tl::unexpected(entries.error());
  JointImportSettings in;
  auto ok =
      within(*entries, "stddev", "joints_in", 0, kMaxStddev, in.stddev)
          .and_then([&] { return patterns(*entries, "joints", "joints_in", in.joints.include); })
          .and_then([&] { return patterns(*entries, "except", "joints_in", in.joints.exclude); })
          .and_then([&] { return words(*entries, "partition", "joints_in", in.partition); });
  if (!ok) return ok;
  if (const auto name = check_partition_name(in.partition); !in.partition.empty() && !name) {
    return error(name.error().code, node.Mark(), "joints_in: " + name.error().message);
  }
  if (const auto found = entries->find("stddev_of"); found != entries->end()) {
    const std::string what = "joints_in: stddev_of";
    const auto joints = fields(found->second.value, what);
    if (!joints) return tl::unexpected(joints.error());
    for (const auto& [name, field] : *joints) {
      if (ok = within(*joints, name, what, 0, kMaxStddev, in.stddev_of[name]); !ok) return ok;
    }
  }
  settings.joints_in = std::move(in);
  return {};
}

Result<void> Reader::joints_out(const YAML::Node& node, Settings& settings) const {
  constexpr std::array<Keys, 2> kKeys = {"partitions", "rate"};
  const auto entries = fields(node, kKeys, "joints_out");
  if (!entries) return tl::unexpected(entries.error());
  JointExportSettings out;
  auto ok =
      require(node, *entries, "partitions", "joints_out")
          .and_then([&] { return patterns(*entries, "partitions", "joints_out", out.partitions); })
          .and_then(
              [&] { return within(*entries, "rate", "joints_out", 0.001, kMaxRate, out.rate); });
  settings.joints_out = std::move(out);
  return ok;
}

Result<void> Reader::description_in(const YAML::Node& node, Settings& settings) const {
  constexpr std::array<Keys, 11> kKeys = {"partition", "root",       "xyz",           "rpy",
                                          "quat",      "links",      "strict_limits", "stddev",
                                          "cov",       "covariance", "fixed"};
  const auto entries = fields(node, kKeys, "description_in");
  if (!entries) return tl::unexpected(entries.error());
  DescriptionSettings in;
  std::string fixed;
  auto ok = words(*entries, "partition", "description_in", in.partition)
                .and_then([&] { return words(*entries, "root", "description_in", in.part.root); })
                .and_then([&] { return list(*entries, "links", "description_in", in.part.links); })
                .and_then([&] {
                  return flag(*entries, "strict_limits", "description_in", in.part.strict_limits);
                })
                .and_then([&] { return words(*entries, "fixed", "description_in", fixed); });
  if (!ok) return ok;
  const auto X_root = transform(node, *entries, "description_in", {});
  if (!X_root) return tl::unexpected(X_root.error());
  in.part.X_root = *X_root;
  if (const auto name = check_new_partition_name(in.partition); !name) {
    return error(name.error().code, node.Mark(), "description_in: " + name.error().message);
  }
  if (!fixed.empty()) {
    const auto stated = covariance_named(fixed);
    if (!stated) return error(stated.error().code, node.Mark(), stated.error().message);
    in.part.fixed = *stated;
  }
  settings.description_in = std::move(in);
  return {};
}

Result<void> Reader::description_out(const YAML::Node& node, Settings& settings) const {
  DescriptionOutSettings out;
  if (!node.IsMap()) {
    auto file = text({node, node.Mark()}, "description_out");
    if (!file) return tl::unexpected(std::move(file.error()));
    out.file = (std::filesystem::path(name()).parent_path() / *file).string();
  } else {
    const auto entries = fields(node, std::array<Keys, 1>{"partition"}, "description_out");
    if (!entries) return tl::unexpected(entries.error());
    auto ok = require(node, *entries, "partition", "description_out").and_then([&] {
      return words(*entries, "partition", "description_out", out.partition);
    });
    if (!ok) return ok;
    if (const auto name = check_partition_name(out.partition); !name) {
      return error(name.error().code, node.Mark(), "description_out: " + name.error().message);
    }
  }
  settings.description_out = std::move(out);
  return {};
}

Result<void> Reader::is_odometry(const YAML::Node& node, const std::string& place,
                                 const std::string& type, bool& out) const {
  out = type == "odometry";
  if (out || type == "pose") return {};
  return error(Errc::kInvalidInput, node.Mark(), place + ": type is neither pose nor odometry");
}

Result<void> Reader::poses_in(const YAML::Node& node, Settings& settings) const {
  if (!node.IsSequence()) return error(Errc::kConfig, node.Mark(), "poses_in is not a list");
  constexpr std::array<Keys, 5> kKeys = {"topic", "type", "child", "gate", "correlated"};
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string what = "poses_in[" + std::to_string(i) + "]";
    const auto entries = fields(node[i], kKeys, what);
    if (!entries) return tl::unexpected(entries.error());
    PoseIn in;
    std::string type = "pose";
    bool correlated = false;
    auto ok =
        require(node[i], *entries, "topic", what)
            .and_then([&] { return words(*entries, "topic", what, in.topic); })
            .and_then([&] { return words(*entries, "type", what, type); })
            .and_then([&] { return words(*entries, "child", what, in.child); })
            .and_then([&] { return within(*entries, "gate", what, 1e-9, 1, in.options.gate); })
            .and_then([&] { return flag(*entries, "correlated", what, correlated); });
    if (!ok) return ok;
    if (ok = is_odometry(node[i], what, type, in.odometry); !ok) return ok;
    in.options.independent = !correlated;
    if (in.odometry == in.child.empty()) {
      settings.poses_in.push_back(std::move(in));
      continue;
    }
    return error(Errc::kInvalidInput, node[i].Mark(),
                 what + (in.odometry ? ": odometry names the child itself"
                                     : ": child is missing, the frame that is measured"));
  }
  return {};
}

Result<void> Reader::poses_out(const YAML::Node& node, Settings& settings) const {
  if (!node.IsSequence()) return error(Errc::kConfig, node.Mark(), "poses_out is not a list");
  constexpr std::array<Keys, 5> kKeys = {"topic", "type", "frame", "child", "rate"};
  for (std::size_t i = 0; i < node.size(); ++i) {
    const std::string what = "poses_out[" + std::to_string(i) + "]";
    const auto entries = fields(node[i], kKeys, what);
    if (!entries) return tl::unexpected(entries.error());
    PoseOut out;
    std::string type = "pose";
    auto ok = require(node[i], *entries, "topic", what)
                  .and_then([&] { return require(node[i], *entries, "frame", what); })
                  .and_then([&] { return require(node[i], *entries, "child", what); })
                  .and_then([&] { return words(*entries, "topic", what, out.topic); })
                  .and_then([&] { return words(*entries, "frame", what, out.frame); })
                  .and_then([&] { return words(*entries, "child", what, out.child); })
                  .and_then([&] { return within(*entries, "rate", what, 0, kMaxRate, out.rate); });
    if (ok) ok = words(*entries, "type", what, type);
    if (ok) ok = is_odometry(node[i], what, type, out.odometry);
    if (!ok) return ok;
    settings.poses_out.push_back(std::move(out));
  }
  return {};
}

Result<void> Reader::read(const YAML::Node& root, Settings& settings) const {
  static constexpr std::array<std::pair<Keys, Section>, 8> kSections = {{
      {"tf_in", &Reader::tf_in},
      {"tf_out", &Reader::tf_out},
      {"joints_in", &Reader::joints_in},
      {"joints_out", &Reader::joints_out},
      {"description_in", &Reader::description_in},
      {"description_out", &Reader::description_out},
      {"poses_in", &Reader::poses_in},
      {"poses_out", &Reader::poses_out},
  }};
  constexpr std::array<Keys, 12> kKeys = {
      "partition", "clock",      "ros_domain",     "prefix",          "tf_in",    "tf_out",
      "joints_in", "joints_out", "description_in", "description_out", "poses_in", "poses_out"};
  const std::string place = "the file";
  const auto entries = fields(root, kKeys, place);
  if (!entries) return tl::unexpected(entries.error());
  double domain = settings.ros_domain;
  std::string prefix;
  std::string clock = "system";
  auto ok = words(*entries, "partition", place, settings.partition)
                .and_then([&] { return within(*entries, "ros_domain", place, 0, 232, domain); })
                .and_then([&] { return words(*entries, "prefix", place, prefix); })
                .and_then([&] { return words(*entries, "clock", place, clock); });
  if (!ok) return ok;
  if (clock != "system" && clock != "external" && clock != "ros") {
    return error(Errc::kInvalidInput, entries->find("clock")->second.mark,
                 "clock must be system, external or ros, not " + tfdude::quote(clock));
  }
  if (clock != "system") settings.options.clock = ClockKind::kExternal;
  settings.passes_clock = clock == "ros";
  settings.ros_domain = static_cast<std::uint32_t>(domain);
  for (const auto& [key, section] : kSections) {
    const auto found = entries->find(key);
    if (found == entries->end()) continue;
    if (ok = (this->*section)(found->second.value, settings); !ok) return ok;
  }
  set_prefix(prefix, settings);
  return {};
}

}  // namespace

Result<void> parse_config(const std::string& text, const std::string& name, Settings& settings) {
  const Reader reader(name);
  return reader.read_document(text,
                              [&](const YAML::Node& root) { return reader.read(root, settings); });
}

Result<void> load_config(const std::string& path, Settings& settings) {
  const auto text = read_text(path);
  if (!text) return tl::unexpected(text.error());
  return parse_config(*text, path, settings);
}

}  // namespace tfdude::ros
