#include "tree/id_table.hpp"

#include <algorithm>
#include <functional>
#include <memory>
#include <new>

namespace tfdude {

const Name* Name::create(Arena& arena, std::string_view id, std::uint32_t hashed,
                         std::uint32_t number) {
  auto* memory = static_cast<char*>(arena.allocate(sizeof(Name) + id.size()));
  char* text = memory + sizeof(Name);
  id.copy(text, id.size());
  return new (memory) Name({text, id.size()}, hashed, number);
}

void Name::destroy(Arena& arena, const Name* name) {
  if (name == nullptr) return;
  const std::size_t bytes = sizeof(Name) + name->text.size();
  name->~Name();
  arena.release(const_cast<Name*>(name), bytes);  // NOLINT(*-const-cast): as delete does
}

std::uint32_t IdTable::hash_of(std::string_view id) {
  return static_cast<std::uint32_t>(std::hash<std::string_view>{}(id));
}

IdTable::IdTable(Arena& arena)
    : arena_(arena), table_(arena.roots().names), tombstone_(Name::create(arena, {}, 0, 0)) {
  table_.store(new_table(64), std::memory_order_release);
}

IdTable::~IdTable() {
  for (const Limbo& one : limbo_) destroy(one);
  Table* last = table();
  for (std::size_t i = 0; i < last->size(); ++i) {
    const Name* name = last->cells()[i].load(std::memory_order_relaxed);
    if (name != tombstone_) Name::destroy(arena_, name);
  }
  Name::destroy(arena_, tombstone_);
  destroy({0, nullptr, last});
}

IdTable::Table* IdTable::new_table(std::size_t capacity) {
  auto* table =
      new (arena_.allocate(sizeof(Table) + capacity * sizeof(Table::Cell))) Table{capacity - 1};
  std::uninitialized_value_construct_n(table->cells(), capacity);
  return table;
}

void IdTable::destroy(const Limbo& one) {
  Name::destroy(arena_, one.name);
  if (one.table == nullptr) return;
  arena_.release(one.table, sizeof(Table) + one.table->size() * sizeof(Table::Cell));
}

const Name* IdTable::find(std::string_view id) const {
  const std::uint32_t hash = hash_of(id);
  Table& table = *this->table();
  for (std::size_t i = hash & table.mask;; i = (i + 1) & table.mask) {
    const Name* name = table.cells()[i].load(std::memory_order_acquire);
    if (name == nullptr) return nullptr;
    if (name != tombstone_ && name->hash == hash && name->text == id) return name;
  }
}

const Name* IdTable::insert(std::string_view id, std::uint32_t slot) {
  if ((used_ + 1) * 3 > table()->size() * 2) grow();
  const Name* name = Name::create(arena_, id, hash_of(id), slot);
  if (place(*table(), name)) ++used_;
  ++names_;
  return name;
}

void IdTable::erase(const Name* name) {
  Table& table = *this->table();
  std::size_t i = name->hash & table.mask;
  while (table.cells()[i].load(std::memory_order_relaxed) != name) i = (i + 1) & table.mask;
  table.cells()[i].store(tombstone_, std::memory_order_release);
  // Tombstones before an empty cell serve no probe. They are cleared, so that repeated insertion
  // and removal does not fill the table.
  if (table.cells()[(i + 1) & table.mask].load(std::memory_order_relaxed) == nullptr) {
    while (table.cells()[i].load(std::memory_order_relaxed) == tombstone_) {
      table.cells()[i].store(nullptr, std::memory_order_release);
      --used_;
      i = (i - 1) & table.mask;
    }
  }
  --names_;
  limbo_.push_back({0, name, nullptr});
}

void IdTable::collect(std::uint64_t tag, std::uint64_t safe_below) {
  for (; tagged_ < limbo_.size(); ++tagged_) limbo_[tagged_].tag = tag;
  const auto first_kept = std::find_if(limbo_.begin(), limbo_.end(),
                                       [&](const Limbo& l) { return l.tag >= safe_below; });
  std::for_each(limbo_.begin(), first_kept, [this](const Limbo& one) { destroy(one); });
  tagged_ -= static_cast<std::size_t>(first_kept - limbo_.begin());
  limbo_.erase(limbo_.begin(), first_kept);
}

void IdTable::grow() {
  // Sized by the live names, so that a table full of tombstones is cleaned rather than doubled.
  std::size_t capacity = 64;
  while (capacity < (names_ + 1) * 2) capacity *= 2;
  Table* fresh = new_table(capacity);
  Table* old = table();
  for (std::size_t i = 0; i < old->size(); ++i) {
    const Name* name = old->cells()[i].load(std::memory_order_relaxed);
    if (name != nullptr && name != tombstone_) (void)place(*fresh, name);
  }
  used_ = names_;
  table_.store(fresh, std::memory_order_release);
  limbo_.push_back({0, nullptr, old});
}

bool IdTable::place(Table& table, const Name* name) const {
  std::size_t i = name->hash & table.mask;
  while (true) {
    const Name* there = table.cells()[i].load(std::memory_order_relaxed);
    if (there == nullptr || there == tombstone_) {
      table.cells()[i].store(name, std::memory_order_release);
      return there == nullptr;
    }
    i = (i + 1) & table.mask;
  }
}

}  // namespace tfdude
