// Launch files of ROS 2 in YAML.

#include <array>
#include <optional>
#include <utility>

#include "description/launch_starts.hpp"
#include "description/yaml_fields.hpp"

namespace tfdude {
namespace {

class LaunchReader : public YamlFields {
 public:
  using YamlFields::YamlFields;

  [[nodiscard]] Result<void> read(const YAML::Node& root) {
    const auto top = fields(root, "the file");
    if (!top) return tl::unexpected(top.error());
    const auto found = top->find("launch");
    if (found == top->end()) return fail(Errc::kConfig, name() + ": launch is missing");
    return actions(found->second, "launch");
  }

  [[nodiscard]] std::vector<LaunchStart> starts() && { return std::move(starts_); }

 private:
  // A list of entries with one action each.
  [[nodiscard]] Result<void> actions(const Field& list, const std::string& what) {
    if (!list.value.IsSequence()) {
      return error(Errc::kConfig, list.mark, what + " is not a list of actions");
    }
    for (const auto& entry : list.value) {
      const auto action = fields(entry, "an action of " + what);
      if (!action) return tl::unexpected(action.error());
      for (const auto& [kind, field] : *action) {
        const auto done = kind == "node"    ? node(field)
                          : kind == "group" ? group(field)
                                            : other(field);
        if (!done) return done;
      }
    }
    return {};
  }

  // A command, or what a variable stands for: only the launch system could tell what they start.
  [[nodiscard]] Result<void> other(const Field& field) const {
    if (!field.value.IsMap()) return {};
    for (const auto& entry : field.value) {
      const bool is_text = entry.first.IsScalar() && entry.second.IsScalar();
      if (!is_text || !mentions_publisher(entry.second.Scalar())) continue;
      const std::string& key = entry.first.Scalar();
      if (key != "cmd" && key != "default" && key != "value" && key != "launch-prefix") continue;
      return error(Errc::kInvalidInput, entry.second.Mark(), unread_start());
    }
    return {};
  }

  // Its actions alone, or with conditions beside them.
  [[nodiscard]] Result<void> group(const Field& field) {
    if (!field.value.IsMap()) return actions(field, "group");
    const auto keys = fields(field.value, "group");
    if (!keys) return tl::unexpected(keys.error());
    const auto children = keys->find("children");
    if (children == keys->end()) return {};
    // Conditions count only where they decide about a start.
    std::vector<LaunchStart> before = std::exchange(starts_, {});
    if (auto ok = actions(children->second, "group"); !ok) return ok;
    if (!starts_.empty()) {
      const auto happens = holds(*keys, "group");
      if (!happens) return tl::unexpected(happens.error());
      if (!*happens) starts_.clear();
    }
    before.insert(before.end(), std::make_move_iterator(starts_.begin()),
                  std::make_move_iterator(starts_.end()));
    starts_ = std::move(before);
    return {};
  }

  [[nodiscard]] Result<void> node(const Field& field) {
    const auto keys = fields(field.value, "node");
    if (!keys) return tl::unexpected(keys.error());
    const auto is = [&](const char* key, const char* value) {
      const auto found = keys->find(key);
      return found != keys->end() && found->second.value.IsScalar() &&
             found->second.value.Scalar() == value;
    };
    if (!is("exec", kStaticPublisher)) return {};
    const auto happens = holds(*keys, "node");
    if (!happens) return tl::unexpected(happens.error());
    if (!*happens) return {};
    const int line = field.value.Mark().line + 1;
    LaunchStart start{{}, is("pkg", "tf"), line};
    if (const auto args = keys->find("args"); args != keys->end()) {
      const auto said = text(args->second, "node: args");
      if (!said) return tl::unexpected(said.error());
      start.line = args->second.mark.line + 1;
      auto words = launch_words(*said, name(), start.line);
      if (!words) return tl::unexpected(std::move(words.error()));
      start.words = *std::move(words);
    }
    starts_.push_back(std::move(start));
    return {};
  }

  [[nodiscard]] Result<bool> holds(const Fields& keys, const std::string& what) const {
    for (const bool wanted : {true, false}) {
      const auto found = keys.find(wanted ? "if" : "unless");
      if (found == keys.end()) continue;
      const auto said = text(found->second, what + ": " + found->first);
      if (!said) return tl::unexpected(said.error());
      const auto yes = launch_condition(*said, what, name(), found->second.mark.line + 1);
      if (!yes) return yes;
      if (*yes != wanted) return false;
    }
    return true;
  }

  std::vector<LaunchStart> starts_;
};

}  // namespace

Result<std::vector<LaunchStart>> starts_in_yaml(const std::string& text, const std::string& name) {
  LaunchReader reader(name);
  auto ok = reader.read_document(text, [&](const YAML::Node& root) { return reader.read(root); });
  if (!ok) return tl::unexpected(std::move(ok.error()));
  return std::move(reader).starts();
}

}  // namespace tfdude
