#pragma once

#include <cstddef>
#include <string>
#include <vector>

// Parts of tables that fit a terminal, however long names and numbers are.
namespace tfdude::cli {

/// Number of characters of a text in UTF-8, without escapes of colours.
[[nodiscard]] std::size_t length_of(const std::string& text);

/// The first characters of a text in UTF-8, with the colours that they have.
[[nodiscard]] std::string first_characters(const std::string& text, std::size_t count);

/// A text of at most so many characters. If it is too long, its middle is left out: names often
/// differ only at their ends.
[[nodiscard]] std::string shortened(const std::string& text, std::size_t columns);

/// The most that a name may have on this terminal. What it has beyond 80 columns is for names.
/// @param at_80  the most that the name may have on a terminal of 80 columns
/// @param beside  the same of other names in that line
[[nodiscard]] std::size_t room(std::size_t at_80, std::size_t beside = 0);

/// The width of a column of names: as the longest of them needs, at most room().
[[nodiscard]] std::size_t name_width(const std::vector<std::string>& names, std::size_t at_80,
                                     std::size_t beside = 0);

/// The names in a list, for name_width().
template <class Row>
[[nodiscard]] std::vector<std::string> names_of(const std::vector<Row>& rows,
                                                std::string Row::*name) {
  std::vector<std::string> names;
  names.reserve(rows.size());
  for (const Row& row : rows) names.push_back(row.*name);
  return names;
}

/// A name at the left of its column, shortened if it is too long.
[[nodiscard]] std::string cell(const std::string& name, std::size_t width);

/// A number with so many decimals; in powers of ten if it would need too many columns.
[[nodiscard]] std::string number(double value, int decimals, std::size_t columns);

}  // namespace tfdude::cli
