#pragma once

#include <algorithm>
#include <string>

#include <nlohmann/json.hpp>

namespace tfdude::testing {

/// Checks values against a JSON Schema, as far as docs/cli.schema.json uses that language.
class JsonSchema {
 public:
  using json = nlohmann::json;

  explicit JsonSchema(json schema) : schema_(std::move(schema)) {}

  /// The schema itself.
  [[nodiscard]] const json& root() const { return schema_; }

  /// What is wrong with a value, and where; empty: nothing.
  [[nodiscard]] std::string error(const json& schema, const json& value,
                                  const std::string& where = "") const {
    for (const auto& [keyword, rule] : schema.items()) {
      std::string wrong = check(keyword, rule, schema, value, where);
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

 private:
  [[nodiscard]] std::string check(const std::string& keyword, const json& rule, const json& schema,
                                  const json& value, const std::string& where) const {
    if (keyword == "$ref") {
      return error(schema_.at(json::json_pointer(rule.get<std::string>().substr(1))), value, where);
    }
    if (keyword == "type") return has_type(rule, value) ? "" : where + ": is not " + rule.dump();
    if (keyword == "const") return value == rule ? "" : where + ": is not " + rule.dump();
    if (keyword == "enum") {
      const bool one = std::find(rule.begin(), rule.end(), value) != rule.end();
      return one ? "" : where + ": " + value.dump() + " is none of " + rule.dump();
    }
    if (keyword == "anyOf") return any_of(rule, value, where);
    if (keyword == "items") return items(rule, value, where);
    // Other rules hold for values of their kind only.
    if (keyword == "minItems" || keyword == "maxItems") return size(keyword, rule, value, where);
    if (keyword == "required") return required(rule, value, where);
    if (keyword == "properties") return properties(schema, value, where);
    if (keyword == "additionalProperties" || keyword == "description") return "";
    return where + ": the test does not know the keyword " + keyword;
  }

  static bool is(const std::string& type, const json& value) {
    if (type == "null") return value.is_null();
    if (type == "boolean") return value.is_boolean();
    if (type == "integer") return value.is_number_integer();
    if (type == "number") return value.is_number();
    if (type == "string") return value.is_string();
    if (type == "array") return value.is_array();
    return type == "object" && value.is_object();
  }
  static bool has_type(const json& rule, const json& value) {
    if (rule.is_string()) return is(rule, value);
    return std::any_of(rule.begin(), rule.end(), [&](const json& one) { return is(one, value); });
  }

  [[nodiscard]] std::string any_of(const json& rule, const json& value,
                                   const std::string& where) const {
    std::string all;
    for (const json& one : rule) {
      const std::string wrong = error(one, value, where);
      if (wrong.empty()) return "";
      all += " (" + wrong + ")";
    }
    return where + ": fits none:" + all;
  }

  static std::string size(const std::string& keyword, const json& rule, const json& value,
                          const std::string& where) {
    if (!value.is_array()) return "";
    const bool fits = keyword == "minItems" ? value.size() >= rule : value.size() <= rule;
    return fits ? "" : where + ": " + std::to_string(value.size()) + " items";
  }

  [[nodiscard]] std::string items(const json& rule, const json& value,
                                  const std::string& where) const {
    if (!value.is_array()) return "";
    for (std::size_t i = 0; i < value.size(); ++i) {
      std::string wrong = error(rule, value[i], where + "/" + std::to_string(i));
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

  static std::string required(const json& rule, const json& value, const std::string& where) {
    for (const json& name : rule) {
      if (value.is_object() && !value.contains(name.get<std::string>()))
        return where + ": lacks " + name.dump();
    }
    return "";
  }

  [[nodiscard]] std::string properties(const json& schema, const json& value,
                                       const std::string& where) const {
    if (!value.is_object()) return "";
    const json& known = schema.at("properties");
    for (const auto& [name, member] : value.items()) {
      const std::string at = where + "/" + name;
      if (!known.contains(name)) {
        if (schema.value("additionalProperties", true)) continue;
        return at + ": is not described";
      }
      std::string wrong = error(known.at(name), member, at);
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

  json schema_;
};

}  // namespace tfdude::testing
