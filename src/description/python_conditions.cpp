#include "description/python_conditions.hpp"

#include <algorithm>
#include <array>

namespace tfdude {
namespace {

template <std::size_t N>
bool is_one_of(std::string_view word, const std::array<std::string_view, N>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

constexpr std::array<std::string_view, 10> kDeciding = {"if",  "elif",   "else",  "for",  "while",
                                                        "try", "except", "match", "case", "async"};
constexpr std::array<std::string_view, 7> kChoosing = {"if",  "else", "for",   "while",
                                                       "and", "or",   "lambda"};

}  // namespace

PythonConditions::Place PythonConditions::add(Place outer, int line) {
  const auto place = static_cast<Place>(scopes_.size());
  scopes_.push_back({outer, outer == kNone ? place : scopes_[outer].statement, line});
  return place;
}

void PythonConditions::begin_line(std::size_t indentation, std::string_view first, int line) {
  while (!blocks_.empty() && blocks_.back().indentation >= indentation) blocks_.pop_back();
  const int outer = blocks_.empty() ? 0 : blocks_.back().line;
  const bool is_function = first == "def";
  const bool decides = is_one_of(first, kDeciding);
  if (is_function || decides || first == "class" || first == "with") {
    blocks_.push_back({indentation, decides ? line : outer, is_function, 0});
  }
  int because = blocks_.empty() ? 0 : blocks_.back().line;
  for (auto block = blocks_.rbegin(); because == 0 && block != blocks_.rend(); ++block) {
    because = block->returned;
    if (block->is_function) break;
  }
  item_ = add(kNone, because);
}

void PythonConditions::note_return(int line) {
  if (blocks_.empty() || blocks_.back().line == 0) return;
  for (auto block = blocks_.rbegin(); block != blocks_.rend(); ++block) {
    if (!block->is_function) continue;
    if (block->returned == 0) block->returned = line;
    return;
  }
}

void PythonConditions::word(std::string_view word, int line) {
  if (item_ == kNone) return;
  if (word == "return") note_return(line);
  if (scopes_[item_].line == 0 && is_one_of(word, kChoosing)) scopes_[item_].line = line;
}

void PythonConditions::open() {
  const Place bracket = add(item_, 0);
  open_.emplace_back(item_, bracket);
  item_ = add(bracket, 0);
}

void PythonConditions::close() {
  if (open_.empty()) return;
  item_ = open_.back().first;
  open_.pop_back();
}

void PythonConditions::comma() {
  if (!open_.empty()) item_ = add(open_.back().second, 0);
}

void PythonConditions::keyword(std::string_view name, int line) {
  if (name == "condition" && !open_.empty()) scopes_[open_.back().second].line = line;
}

// What is outside comes before.
void PythonConditions::finish() {
  for (Scope& scope : scopes_) {
    if (scope.line == 0 && scope.outer != kNone) scope.line = scopes_[scope.outer].line;
  }
}

}  // namespace tfdude
