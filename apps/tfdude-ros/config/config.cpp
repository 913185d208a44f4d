#include "config.hpp"

#include <array>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "description/file_text.hpp"
#include "description/yaml_fields.hpp"

namespace tfdude::ros {
namespace {

using Key = std::string_view;

constexpr double kMaxRate = 1e6;
constexpr double kMaxStddev = 1e9;

// A mapping, whose entries are read one after the other, until one is wrong. An entry that is left
// out leaves its value as it is.
class Mapping : private YamlFields {
 public:
  template <std::size_t N>
  Mapping(const std::string& file, const YAML::Node& node, const std::array<Key, N>& keys,
          std::string place)
      : YamlFields(file), node_(node), place_(std::move(place)) {
    store(fields(node, keys, place_), entries_);
  }

  // An entry that must be there.
  Mapping& require(Key key) {
    return check(has(key), Errc::kConfig, ": " + std::string(key) + " is missing");
  }
  Mapping& words(Key key, std::string& out) {
    if (ok_ && has(key)) store(text(field(key), what(key)), out);
    return *this;
  }
  Mapping& flag(Key key, bool& out) {
    if (ok_) ok_ = YamlFields::flag(entries_, key, place_, out);
    return *this;
  }
  Mapping& list(Key key, std::vector<std::string>& out) {
    if (!ok_ || !has(key)) return *this;
    const YAML::Node& all = field(key).value;
    if (!all.IsSequence()) return fail(Errc::kConfig, what(key) + " is not a list", key);
    out.resize(all.size());
    for (std::size_t i = 0; i < all.size() && ok_; ++i) {
      store(text({all[i], all[i].Mark()}, what(key)), out[i]);
    }
    return *this;
  }
  Mapping& patterns(Key key, Patterns& out) {
    std::vector<std::string> texts;
    list(key, texts);
    out = Patterns(std::move(texts));
    return *this;
  }
  // A number within a range, which the error names.
  // @tparam Number  double or std::optional<double>
  template <class Number>
  Mapping& within(Key key, double least, double most, Number& out) {
    std::optional<double> value;
    if (ok_) ok_ = number(entries_, key, place_, value);
    if (!value) return *this;
    out = *value;
    if (*value >= least && *value <= most) return *this;
    return fail(Errc::kInvalidInput,
                what(key) + " is not within " + number_text(least) + " and " + number_text(most),
                key);
  }
  // A mapping of such numbers.
  Mapping& within(Key key, double least, double most, std::map<std::string, double>& out) {
    if (!ok_ || !has(key)) return *this;
    Mapping all(name(), field(key).value, std::array<Key, 0>{}, what(key));
    for (const auto& [one, value] : all.entries_) all.within(one, least, most, out[one]);
    ok_ = all.ok_;
    return *this;
  }
  Mapping& transform(Transform& out) {
    if (ok_) store(YamlFields::transform(node_, entries_, place_, out.covariance), out);
    return *this;
  }
  // "pose" or "odometry"
  Mapping& type(bool& odometry) {
    std::string type = "pose";
    words("type", type);
    odometry = type == "odometry";
    return check(odometry || type == "pose", Errc::kInvalidInput,
                 ": type is neither pose nor odometry");
  }
  // A rule for all entries together. @param broken  follows the place in the error
  Mapping& check(bool good, Errc code, const std::string& broken) {
    return good ? *this : fail(code, place_ + broken);
  }
  Mapping& check(const Result<void>& rule) {
    return rule ? *this : check(false, rule.error().code, ": " + rule.error().message);
  }

  [[nodiscard]] const Result<void>& result() const { return ok_; }
  // The value of an entry; null if it is left out.
  [[nodiscard]] const YAML::Node* value(Key key) const {
    return has(key) ? &field(key).value : nullptr;
  }
  // @param at  absent: at the mapping
  Mapping& fail(Errc code, const std::string& message, std::optional<Key> at = {}) {
    if (ok_) ok_ = error(code, at ? field(*at).mark : node_.Mark(), message);
    return *this;
  }

 private:
  template <class Value>
  void store(Result<Value> value, Value& out) {
    if (value) {
      out = *std::move(value);
    } else {
      ok_ = tl::unexpected(std::move(value.error()));
    }
  }
  [[nodiscard]] bool has(Key key) const { return entries_.find(key) != entries_.end(); }
  [[nodiscard]] const Field& field(Key key) const { return entries_.find(key)->second; }
  [[nodiscard]] std::string what(Key key) const { return place_ + ": " + std::string(key); }

  const YAML::Node node_;
  const std::string place_;
  Fields entries_;
  Result<void> ok_;
};

struct Scalars : YamlFields {
  using YamlFields::text;
  using YamlFields::YamlFields;
};

// A section of a file.
struct Section {
  YAML::Node node;
  const std::string& file;
};

Result<void> tf_in(const Section& section, Settings& settings) {
  // "tf_in: false" instead of a mapping.
  if (section.node.IsScalar() && section.node.Scalar() == "false") {
    settings.frames_in.reset();
    return {};
  }
  constexpr std::array<Key, 5> kKeys = {"frames", "except", "stddev", "cov", "covariance"};
  ImportSettings& in = settings.frames_in.emplace();
  Transform X{Pose(), in.covariance};
  const auto ok = Mapping(section.file, section.node, kKeys, "tf_in")
                      .patterns("frames", in.frames.include)
                      .patterns("except", in.frames.exclude)
                      .transform(X)
                      .result();
  in.covariance = X.covariance;
  return ok;
}

Result<void> tf_out(const Section& section, Settings& settings) {
  ExportSettings& out = settings.frames_out.emplace();
  constexpr std::array<Key, 3> kKeys = {"partitions", "frames", "rate"};
  return Mapping(section.file, section.node, kKeys, "tf_out")
      .patterns("partitions", out.partitions)
      .patterns("frames", out.frames)
      .within("rate", 0, kMaxRate, out.rate)
      .result();
}

Result<void> joints_in(const Section& section, Settings& settings) {
  JointImportSettings& in = settings.joints_in.emplace();
  constexpr std::array<Key, 5> kKeys = {"stddev", "stddev_of", "joints", "except", "partition"};
  Mapping entries(section.file, section.node, kKeys, "joints_in");
  entries.within("stddev", 0, kMaxStddev, in.stddev)
      .patterns("joints", in.joints.include)
      .patterns("except", in.joints.exclude)
      .words("partition", in.partition);
  if (!in.partition.empty()) entries.check(check_partition_name(in.partition));
  return entries.within("stddev_of", 0, kMaxStddev, in.stddev_of).result();
}

Result<void> joints_out(const Section& section, Settings& settings) {
  JointExportSettings& out = settings.joints_out.emplace();
  return Mapping(section.file, section.node, std::array<Key, 2>{"partitions", "rate"}, "joints_out")
      .require("partitions")
      .patterns("partitions", out.partitions)
      .within("rate", 0.001, kMaxRate, out.rate)
      .result();
}

Result<void> description_in(const Section& section, Settings& settings) {
  constexpr std::array<Key, 11> kKeys = {"partition", "root",       "xyz",           "rpy",
                                         "quat",      "links",      "strict_limits", "stddev",
                                         "cov",       "covariance", "fixed"};
  DescriptionSettings& in = settings.description_in.emplace();
  std::string fixed;
  in.part.X_root = Transform{Pose(), {}};
  Mapping entries(section.file, section.node, kKeys, "description_in");
  entries.words("partition", in.partition)
      .words("root", in.part.root)
      .list("links", in.part.links)
      .flag("strict_limits", in.part.strict_limits)
      .words("fixed", fixed)
      .transform(in.part.X_root);
  entries.check(check_new_partition_name(in.partition));
  if (entries.result() && !fixed.empty()) {
    const auto stated = covariance_named(fixed);
    if (!stated) return entries.fail(stated.error().code, stated.error().message).result();
    in.part.fixed = *stated;
  }
  return entries.result();
}

Result<void> description_out(const Section& section, Settings& settings) {
  DescriptionOutSettings& out = settings.description_out.emplace();
  if (section.node.IsMap()) {
    constexpr std::array<Key, 1> kKeys = {"partition"};
    Mapping entries(section.file, section.node, kKeys, "description_out");
    entries.require("partition").words("partition", out.partition);
    return entries.check(check_partition_name(out.partition)).result();
  }
  const auto file =
      Scalars(section.file).text({section.node, section.node.Mark()}, "description_out");
  if (!file) return tl::unexpected(file.error());
  out.file = (std::filesystem::path(section.file).parent_path() / *file).string();
  return {};
}

// Reads the entries of a list.
// @param read  gets an empty entry, its node and its place
template <class Entry, class Read>
Result<void> each(const Section& section, const std::string& what, std::vector<Entry>& all,
                  Read read) {
  if (!section.node.IsSequence()) {
    return Scalars(section.file).error(Errc::kConfig, section.node.Mark(), what + " is not a list");
  }
  for (std::size_t i = 0; i < section.node.size(); ++i) {
    auto& entry = all.emplace_back();
    const auto ok = read(entry, section.node[i], what + "[" + std::to_string(i) + "]");
    if (!ok) return ok;
  }
  return {};
}

Result<void> poses_in(const Section& section, Settings& settings) {
  constexpr std::array<Key, 5> kKeys = {"topic", "type", "child", "gate", "correlated"};
  const auto read = [&](PoseIn& in, const YAML::Node& node, const std::string& place) {
    bool correlated = false;
    Mapping entries(section.file, node, kKeys, place);
    entries.require("topic")
        .words("topic", in.topic)
        .words("child", in.child)
        .within("gate", 1e-9, 1, in.options.gate)
        .flag("correlated", correlated)
        .type(in.odometry);
    entries.check(in.odometry == in.child.empty(), Errc::kInvalidInput,
                  in.odometry ? ": odometry names the child itself"
                              : ": child is missing, the frame that is measured");
    in.options.independent = !correlated;
    return entries.result();
  };
  return each(section, "poses_in", settings.poses_in, read);
}

Result<void> poses_out(const Section& section, Settings& settings) {
  constexpr std::array<Key, 5> kKeys = {"topic", "type", "frame", "child", "rate"};
  const auto read = [&](PoseOut& out, const YAML::Node& node, const std::string& place) {
    return Mapping(section.file, node, kKeys, place)
        .require("topic")
        .require("frame")
        .require("child")
        .words("topic", out.topic)
        .words("frame", out.frame)
        .words("child", out.child)
        .within("rate", 0, kMaxRate, out.rate)
        .type(out.odometry)
        .result();
  };
  return each(section, "poses_out", settings.poses_out, read);
}

Result<void> read(const YAML::Node& root, const std::string& file, Settings& settings) {
  static constexpr std::array<std::pair<Key, Result<void> (*)(const Section&, Settings&)>, 8>
      kSections = {{{"tf_in", tf_in},
                    {"tf_out", tf_out},
                    {"joints_in", joints_in},
                    {"joints_out", joints_out},
                    {"description_in", description_in},
                    {"description_out", description_out},
                    {"poses_in", poses_in},
                    {"poses_out", poses_out}}};
  constexpr std::array<Key, 12> kKeys = {
      "partition", "clock",      "ros_domain",     "prefix",          "tf_in",    "tf_out",
      "joints_in", "joints_out", "description_in", "description_out", "poses_in", "poses_out"};
  double domain = settings.ros_domain;
  std::string prefix;
  std::string clock = "system";
  Mapping entries(file, root, kKeys, "the file");
  entries.words("partition", settings.partition)
      .within("ros_domain", 0, 232, domain)
      .words("prefix", prefix)
      .words("clock", clock);
  if (!entries.result()) return entries.result();
  if (clock != "system" && clock != "external" && clock != "ros") {
    return entries
        .fail(Errc::kInvalidInput,
              "clock must be system, external or ros, not " + tfdude::quote(clock), "clock")
        .result();
  }
  if (clock != "system") settings.options.clock = ClockKind::kExternal;
  settings.passes_clock = clock == "ros";
  settings.ros_domain = static_cast<std::uint32_t>(domain);
  for (const auto& [key, section] : kSections) {
    const YAML::Node* node = entries.value(key);
    if (node == nullptr) continue;
    if (auto ok = section({*node, file}, settings); !ok) return ok;
  }
  set_prefix(prefix, settings);
  return {};
}

}  // namespace

Result<void> parse_config(const std::string& text, const std::string& name, Settings& settings) {
  return Scalars(name).read_document(
      text, [&](const YAML::Node& root) { return read(root, name, settings); });
}

Result<void> load_config(const std::string& path, Settings& settings) {
  const auto text = read_text(path);
  if (!text) return tl::unexpected(text.error());
  return parse_config(*text, path, settings);
}

}  // namespace tfdude::ros
