#include "tree/id_table.hpp"

#include <algorithm>
#include <functional>

namespace tfdude {
namespace {

// Replaces an erased name, so that probing continues past it.
const Name kTombstone;

std::uint32_t hash_of(std::string_view id) {
  return static_cast<std::uint32_t>(std::hash<std::string_view>{}(id));
}

}  // namespace

IdTable::IdTable() : table_(new Table(64)) {}

IdTable::~IdTable() {
  Table* table = table_.load(std::memory_order_relaxed);
  for (auto& cell : table->cells) {
    const Name* name = cell.load(std::memory_order_relaxed);
    if (name != &kTombstone) delete name;
  }
  delete table;
}

const Name* IdTable::find(std::string_view id) const {
  const std::uint32_t hash = hash_of(id);
  const Table& table = *table_.load(std::memory_order_acquire);
  for (std::size_t i = hash & table.mask;; i = (i + 1) & table.mask) {
    const Name* name = table.cells[i].load(std::memory_order_acquire);
    if (name == nullptr) return nullptr;
    if (name != &kTombstone && name->hash == hash && name->text == id) return name;
  }
}

const Name* IdTable::insert(std::string_view id, std::uint32_t slot) {
  Table* table = table_.load(std::memory_order_relaxed);
  if ((used_ + 1) * 3 > table->cells.size() * 2) {
    grow();
    table = table_.load(std::memory_order_relaxed);
  }
  const auto* name = new Name(id, hash_of(id), slot);
  if (place(*table, name)) ++used_;
  ++names_;
  return name;
}

void IdTable::erase(const Name* name) {
  Table& table = *table_.load(std::memory_order_relaxed);
  std::size_t i = name->hash & table.mask;
  while (table.cells[i].load(std::memory_order_relaxed) != name) i = (i + 1) & table.mask;
  table.cells[i].store(&kTombstone, std::memory_order_release);
  // Tombstones before an empty cell serve no probe. They are cleared, so that repeated insertion
  // and removal does not fill the table.
  if (table.cells[(i + 1) & table.mask].load(std::memory_order_relaxed) == nullptr) {
    while (table.cells[i].load(std::memory_order_relaxed) == &kTombstone) {
      table.cells[i].store(nullptr, std::memory_order_release);
      --used_;
      i = (i - 1) & table.mask;
    }
  }
  --names_;
  limbo_.push_back({0, std::unique_ptr<const Name>(name), nullptr});
}

void IdTable::collect(std::uint64_t tag, std::uint64_t safe_below) {
  for (; tagged_ < limbo_.size(); ++tagged_) limbo_[tagged_].tag = tag;
  const auto first_kept = std::find_if(limbo_.begin(), limbo_.end(),
                                       [&](const Limbo& l) { return l.tag >= safe_below; });
  tagged_ -= static_cast<std::size_t>(first_kept - limbo_.begin());
  limbo_.erase(limbo_.begin(), first_kept);
}

void IdTable::grow() {
  // Sized by the live names, so that a table full of tombstones is cleaned rather than doubled.
  std::size_t capacity = 64;
  while (capacity < (names_ + 1) * 2) capacity *= 2;
  auto fresh = std::make_unique<Table>(capacity);
  Table* old = table_.load(std::memory_order_relaxed);
  for (auto& cell : old->cells) {
    const Name* name = cell.load(std::memory_order_relaxed);
    if (name != nullptr && name != &kTombstone) (void)place(*fresh, name);
  }
  used_ = names_;
  table_.store(fresh.release(), std::memory_order_release);
  limbo_.push_back({0, nullptr, std::unique_ptr<Table>(old)});
}

bool IdTable::place(Table& table, const Name* name) {
  std::size_t i = name->hash & table.mask;
  while (true) {
    const Name* there = table.cells[i].load(std::memory_order_relaxed);
    if (there == nullptr || there == &kTombstone) {
      table.cells[i].store(name, std::memory_order_release);
      return there == nullptr;
    }
    i = (i + 1) & table.mask;
  }
}

}  // namespace tfdude
