#include "tfdude/base/similar.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

namespace tfdude {
namespace {

constexpr std::size_t kMost = 3;

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

bool separates(char c) { return c == '/' || c == '_' || c == '.' || c == '-'; }

// Whether the shorter one is a whole part of the longer one.
bool is_part(std::string_view part, std::string_view whole) {
  if (part.size() < 3) return false;
  for (std::size_t at = whole.find(part); at != std::string_view::npos;
       at = whole.find(part, at + 1)) {
    const std::size_t end = at + part.size();
    if ((at == 0 || separates(whole[at - 1])) && (end == whole.size() || separates(whole[end]))) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1);
  std::vector<std::size_t> last(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                           lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::vector<std::string> similar_names(std::string_view name,
                                       const std::vector<std::string>& known) {
  std::vector<std::pair<std::size_t, const std::string*>> near;
  for (const std::string& one : known) {
    if (one == name) continue;
    const std::size_t longer = std::max(one.size(), name.size());
    const std::size_t shorter = std::min(one.size(), name.size());
    const std::size_t most = std::max<std::size_t>(1, longer / 3);
    // The distance is at least the difference of the lengths.
    const std::size_t distance = longer - shorter > most ? longer : edit_distance(name, one);
    if (distance <= most) {
      near.emplace_back(distance, &one);
    } else if (is_part(name, one) || is_part(one, name)) {
      near.emplace_back(most + 1 + longer - shorter, &one);
    }
  }
  const auto end = near.begin() + static_cast<std::ptrdiff_t>(std::min(kMost, near.size()));
  std::partial_sort(near.begin(), end, near.end(), [](const auto& x, const auto& y) {
    return x.first != y.first ? x.first < y.first : *x.second < *y.second;
  });
  std::vector<std::string> names;
  for (auto one = near.begin(); one != end; ++one) names.push_back(*one->second);
  return names;
}

}  // namespace tfdude
