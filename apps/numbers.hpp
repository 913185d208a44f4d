#pragma once

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>

namespace tfdude::cli {

/// The decimal number that a text is as a whole, also "inf" and "nan". One that no double can hold
/// is infinite, or zero.
[[nodiscard]] inline std::optional<double> to_number(const std::string& text) {
  const char* const end = text.data() + text.size();
  const char* begin = text.data();
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
  double number = 0;
  const auto [stop, code] = std::from_chars(begin, end, number);
  if (stop != end || code == std::errc::invalid_argument) return std::nullopt;
  return code == std::errc() ? number : std::strtod(text.c_str(), nullptr);
}

[[nodiscard]] inline bool is_number(const std::string& text) { return to_number(text).has_value(); }

[[nodiscard]] inline bool is_whole_number(const std::string& text) {
  const auto number = to_number(text);
  return number && std::floor(*number) == *number && std::isfinite(*number);
}

/// Makes all options that take numbers, of all commands, reject other text: CLI11 reads an empty
/// text as 0, and 1.5 as 1 where it wants a whole number. Call it after all options are added.
inline void require_numbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options([](CLI::Option* one) {
         const std::string type = one->get_type_name();
         const bool takes_text = type.rfind("TEXT", 0) == 0 || type.rfind("FILE", 0) == 0 ||
                                 type.rfind("NAME", 0) == 0;       // its numbers are checked later
         return one->get_items_expected_max() > 0 && !takes_text;  // a flag expects none
       })) {
    const std::string type = option->get_type_name();
    const bool positive = type.rfind("UINT", 0) == 0;
    const bool whole = positive || type.rfind("INT", 0) == 0;
    // A transform runs before the other checks, such as that of the range.
    option->transform(CLI::Validator(
        [whole, positive](const std::string& text) -> std::string {
          if (!is_number(text)) return "'" + text + "' is not a number";
          if (positive && *to_number(text) < 0) return "'" + text + "' is negative";
          return whole && !is_whole_number(text) ? "'" + text + "' is not a whole number" : "";
        },
        std::string()));
  }
  for (CLI::App* command : app.get_subcommands({})) require_numbers(*command);
}

/// The arguments in the order that CLI::App::parse() expects. "-.5" becomes "-0.5", because CLI11
/// would take it for an option.
[[nodiscard]] inline std::vector<std::string> arguments_of(int argc, char** argv) {
  std::vector<std::string> arguments;
  for (int i = argc - 1; i > 0; --i) {
    std::string text = argv[i];
    if (text.rfind("-.", 0) == 0 && is_number(text)) text.insert(1, 1, '0');
    arguments.push_back(std::move(text));
  }
  return arguments;
}

}  // namespace tfdude::cli
