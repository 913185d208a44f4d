#include "description/yaml_fields.hpp"

#include <charconv>
#include <cmath>
#include <system_error>

#include "tfdude/base/id.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "description/yaml_quirks.hpp"

namespace tfdude {
namespace {

// The key that an error message of TransformSpec::build() is about; its line is reported.
std::string_view blamed_key(const std::string& message, const TransformSpec& spec) {
  const auto starts = [&](std::string_view word) { return message.rfind(word, 0) == 0; };
  if (starts("translation")) return "xyz";
  if (starts("rpy")) return "rpy";
  if (starts("matrix")) return "matrix";
  if (starts("geodetic")) return "geodetic";
  if (starts("rotation")) return "quat";
  if (starts("stddev")) return "stddev";
  if (starts("cov and")) return "cov";
  if (starts("covariance")) return spec.cov ? "cov" : spec.stddev ? "stddev" : "covariance";
  return {};
}

}  // namespace

tl::unexpected<Error> YamlFields::error(Errc code, const YAML::Mark& mark,
                                        const std::string& message) const {
  // A key may contain arbitrary bytes.
  return fail(code, place(mark) + ": " + printable(message));
}

Result<void> YamlFields::read_document(
    const std::string& text, const std::function<Result<void>(const YAML::Node&)>& read) const {
  if (auto ok = check_bytes(name_, text); !ok) return ok;
  try {
    if (auto ok = check_documents(name_, text); !ok) return ok;
    const YAML::Node document = YAML::Load(text);
    if (document.IsNull()) return fail(Errc::kConfig, name_ + ": is empty");
    return read(document);
  } catch (const YAML::Exception& e) {
    return error(Errc::kConfig, e.mark, "not YAML: " + printable(e.msg));
  } catch (const std::exception& e) {
    return fail(Errc::kConfig, name_ + ": " + e.what());
  }
}

std::string YamlFields::place(const YAML::Mark& mark) const {
  return mark.is_null() ? name_ : name_ + ":" + std::to_string(mark.line + 1);
}

Result<YamlFields::Fields> YamlFields::fields(const YAML::Node& map,
                                              const std::vector<std::string_view>& allowed,
                                              const std::string& what) const {
  std::string known;
  for (const auto key : allowed) known.append(known.empty() ? "" : ", ").append(key);
  if (!map.IsMap()) {
    return error(Errc::kConfig, map.Mark(),
                 what + " is not a mapping" + (known.empty() ? "" : " with the keys " + known));
  }
  Fields fields;
  const auto about = [&](std::string_view rest) { return std::string(what).append(rest); };
  for (const auto& entry : map) {
    const YAML::Node& key_node = entry.first;
    if (!key_node.IsScalar()) {
      return error(Errc::kConfig, key_node.Mark(), about(": a key is not plain text"));
    }
    const std::string& key = key_node.Scalar();
    if (!allowed.empty() && std::find(allowed.begin(), allowed.end(), key) == allowed.end()) {
      return error(
          Errc::kConfig, key_node.Mark(),
          about(": unknown key ").append(tfdude::quote(key)).append("; known are ") + known);
    }
    const YAML::Mark mark = entry.second.IsNull() ? key_node.Mark() : entry.second.Mark();
    if (!fields.emplace(key, Field{entry.second, mark}).second) {
      return error(Errc::kConfig, key_node.Mark(),
                   about(": ").append(key).append(" is given twice"));
    }
  }
  return fields;
}

Result<std::string> YamlFields::text(const Field& field, const std::string& what) const {
  if (field.value.IsNull()) return error(Errc::kConfig, field.mark, what + " has no value");
  if (!field.value.IsScalar()) return error(Errc::kConfig, field.mark, what + " is not text");
  return field.value.Scalar();
}

Result<double> YamlFields::number(const YAML::Node& node, const std::string& what) const {
  if (!node.IsScalar() || is_quoted(node)) {
    return error(Errc::kConfig, node.Mark(), what + " is not a number");
  }
  const std::string written = plain_number(node.Scalar());
  double value = 0;
  const auto [end, code] = std::from_chars(written.data(), written.data() + written.size(), value);
  if (code == std::errc::invalid_argument || end != written.data() + written.size()) {
    return error(Errc::kConfig, node.Mark(),
                 what + " is " + tfdude::quote(node.Scalar()) + ", which is not a number");
  }
  if (code == std::errc::result_out_of_range) {
    return error(Errc::kInvalidInput, node.Mark(),
                 what + " is " + tfdude::quote(node.Scalar()) + ", which no double can hold");
  }
  if (!std::isfinite(value)) {
    return error(Errc::kInvalidInput, node.Mark(), what + " is not a finite number");
  }
  return value;
}

Result<void> YamlFields::number(const Fields& fields, std::string_view key,
                                const std::string& place, std::optional<double>& out) const {
  const auto found = fields.find(key);
  if (found == fields.end()) return {};
  const auto value = number(found->second.value, place + ": " + found->first);
  if (!value) return tl::unexpected(value.error());
  out = *value;
  return {};
}

Result<void> YamlFields::flag(const Fields& fields, std::string_view key, const std::string& place,
                              bool& out) const {
  const auto found = fields.find(key);
  if (found == fields.end()) return {};
  const std::string& said = found->second.value.Scalar();
  if (said != "true" && said != "false") {
    return error(Errc::kInvalidInput, found->second.mark,
                 place + ": " + found->first + " is neither true nor false");
  }
  out = said == "true";
  return {};
}

Result<std::string> YamlFields::id(const Fields& fields, std::string_view key,
                                   const std::string& place) const {
  const Field& field = fields.find(key)->second;
  auto value = text(field, place + ": " + std::string(key));
  if (!value) return value;
  if (const auto ok = check_new_id(*value, key); !ok) {
    return error(ok.error().code, field.mark, place + ": " + ok.error().message);
  }
  return value;
}

Result<Transform> YamlFields::transform(const YAML::Node& node, const Fields& fields,
                                        const std::string& place,
                                        const StatedCovariance& otherwise) const {
  TransformSpec spec;
  const auto read = numbers(fields, "xyz", place, spec.xyz)
                        .and_then([&] { return numbers(fields, "rpy", place, spec.rpy); })
                        .and_then([&] { return numbers(fields, "quat", place, spec.quat); })
                        .and_then([&] { return numbers(fields, "matrix", place, spec.matrix); })
                        .and_then([&] { return numbers(fields, "geodetic", place, spec.geodetic); })
                        .and_then([&] { return numbers(fields, "stddev", place, spec.stddev); })
                        .and_then([&] { return numbers(fields, "cov", place, spec.cov); });
  if (!read) return tl::unexpected(read.error());
  if (const auto found = fields.find("covariance"); found != fields.end()) {
    auto word = text(found->second, place + ": covariance");
    if (!word) return tl::unexpected(std::move(word.error()));
    spec.covariance = *std::move(word);
  }
  auto X_PC = spec.build(otherwise);
  if (X_PC) return X_PC;
  const std::string& message = X_PC.error().message;
  const std::string_view key = blamed_key(message, spec);
  const auto field = fields.find(key);
  const bool named = message.rfind(std::string(key) + "[", 0) == 0 || key == "covariance" ||
                     key == "matrix" || key == "geodetic" ||
                     message.find("both given") != std::string::npos;
  return error(X_PC.error().code, field == fields.end() ? node.Mark() : field->second.mark,
               place + ": " + (named ? "" : std::string(key) + ": ") + message);
}

Result<void> YamlFields::check_none(const Fields& fields, const std::vector<const char*>& keys,
                                    const std::string& place, const std::string& needs) const {
  for (const char* key : keys) {
    const auto found = fields.find(key);
    if (found == fields.end()) continue;
    return error(Errc::kConfig, found->second.mark, place + ": " + key + " " + needs);
  }
  return {};
}

Result<void> YamlFields::check_no_pose(const Fields& fields, const std::string& place,
                                       const std::string& needs) const {
  return check_none(fields, {"xyz", "rpy", "quat", "matrix", "geodetic"}, place, needs);
}

Result<void> YamlFields::check_no_transform(const Fields& fields, const std::string& place,
                                            const std::string& needs) const {
  auto ok = check_no_pose(fields, place, needs);
  return ok ? check_none(fields, {"stddev", "cov", "covariance"}, place, needs) : ok;
}

}  // namespace tfdude
