#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"

#include "../logic/names.hpp"
#include "description/yaml_fields.hpp"

// Reads the mappings and lists of a configuration in YAML.
namespace tfdude::ros {

using Key = std::string_view;

inline constexpr double kMaxRate = 1e6;  // [Hz]

/// A mapping, whose entries are read one after the other, until one is wrong. An entry that is left
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
  Mapping& topic(std::string& out) {
    words("topic", out);
    if (!ok_ || is_topic(out)) return *this;
    return fail(Errc::kInvalidInput, what("topic") + " " + quote(out) + " is no name of a topic",
                "topic");
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
  Mapping& six(Key key, std::optional<std::array<double, 6>>& out) {
    if (ok_) ok_ = numbers(entries_, key, place_, out);
    return *this;
  }
  // One of two words. @param second  whether it is the second one
  Mapping& either(Key key, const std::string& first, const std::string& other, bool& second) {
    std::string word = second ? other : first;
    words(key, word);
    second = word == other;
    return check(second || word == first, Errc::kInvalidInput,
                 ": " + std::string(key) + " is neither " + first + " nor " + other);
  }
  // "pose" or "odometry"
  Mapping& type(bool& odometry) { return either("type", "pose", "odometry", odometry); }
  // Also a place on the Earth, and its frame.
  Mapping& type(bool& odometry, std::optional<MessageType>& geodetic, std::string& frame) {
    std::string word = "pose";
    words("type", word).words("frame", frame);
    odometry = word == "odometry";
    if (word == "navsat") geodetic = MessageType::kNavSatFix;
    if (word == "geopose") geodetic = MessageType::kGeoPoseStamped;
    return check(odometry || geodetic || word == "pose", Errc::kInvalidInput,
                 ": type is neither pose nor odometry, navsat or geopose")
        .check(geodetic || !has("frame"), Errc::kInvalidInput,
               ": frame is only for navsat and geopose: the messages name theirs");
  }
  // A rule for all entries together. @param broken  follows the place in the error
  Mapping& check(bool good, Errc code, const std::string& broken) {
    return good ? *this : fail(code, place_ + broken);
  }
  Mapping& check(const Result<void>& rule) {
    return rule ? *this : check(false, rule.error().code, ": " + rule.error().message);
  }

  [[nodiscard]] const Result<void>& result() const { return ok_; }
  [[nodiscard]] std::vector<std::string> keys() const {
    std::vector<std::string> keys;
    for (const auto& [key, field] : entries_) keys.push_back(key);
    return keys;
  }
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

/// Values that are no mappings.
struct Scalars : YamlFields {
  using YamlFields::text;
  using YamlFields::YamlFields;
};

/// A section of a file.
struct Section {
  YAML::Node node;
  const std::string& file;
};

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

}  // namespace tfdude::ros
