#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace tfdude {

/// What decides whether a place of a file in Python is reached: statements and expressions that
/// choose or repeat, a `condition` of an enclosing call, and a return before it that depends.
/// Is told of the words and signs of the file in their order.
class PythonConditions {
 public:
  using Place = std::uint32_t;
  static constexpr Place kNone = UINT32_MAX;

  /// The next word or string is the first of a line outside of brackets.
  void begin_line(std::size_t indentation, std::string_view first, int line);
  void word(std::string_view word, int line);
  void open();
  void close();
  void comma();
  /// A keyword, as in call(keyword=...).
  void keyword(std::string_view name, int line);

  /// The place that comes next.
  [[nodiscard]] Place here() const { return item_; }
  /// Call at the end, before line_of().
  void finish();
  /// The line of what decides about a place; 0: nothing does.
  [[nodiscard]] int line_of(Place place) const { return place == kNone ? 0 : scopes_[place].line; }
  /// The statement that a place is part of: the same for all of its places.
  [[nodiscard]] Place statement_of(Place place) const {
    return place == kNone ? kNone : scopes_[place].statement;
  }

 private:
  // A statement, what is in brackets, or one of its items, which commas divide.
  struct Scope {
    Place outer = kNone;
    Place statement = kNone;
    int line = 0;
  };
  struct Block {
    std::size_t indentation = 0;
    int line = 0;  // of what decides about it; 0: nothing
    bool is_function = false;
    int returned = 0;  // of a function: the first return that depends, so far
  };

  [[nodiscard]] Place add(Place outer, int line);
  void note_return(int line);

  std::vector<Scope> scopes_;
  std::vector<Block> blocks_;
  std::vector<std::pair<Place, Place>> open_;  // the items outside, and the brackets
  Place item_ = kNone;
};

}  // namespace tfdude
