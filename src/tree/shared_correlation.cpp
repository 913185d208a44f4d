#include "tree/shared_correlation.hpp"

#include <cstring>
#include <string>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

using Entry = FlatCorrelation::Entry;

std::size_t padded(std::size_t bytes) { return (bytes + 7) / 8 * 8; }
std::size_t bytes_of_loading(std::size_t columns) { return columns * 6 * sizeof(double); }

std::size_t flat_bytes(const Correlation& correlation) {
  std::size_t bytes = sizeof(FlatCorrelation);
  for (const CommonError& one : correlation.common_errors) {
    bytes += sizeof(Entry) + bytes_of_loading(static_cast<std::size_t>(one.loading.cols())) +
             padded(one.source.size());
  }
  return bytes;
}

class Writer {
 public:
  explicit Writer(void* block) : at_(static_cast<char*>(block)) {}

  void put(const void* from, std::size_t bytes) {
    std::memcpy(at_, from, bytes);
    at_ += padded(bytes);
  }

 private:
  char* at_;
};

// Of a copy that nobody changes.
class Reader {
 public:
  Reader(const char* block, std::size_t bytes) : at_(block), left_(bytes) {}

  /// Null: there are not so many bytes.
  [[nodiscard]] const char* take(std::size_t bytes) {
    if (padded(bytes) > left_) return nullptr;
    const char* taken = at_;
    at_ += padded(bytes);
    left_ -= padded(bytes);
    return taken;
  }
  template <class T>
  [[nodiscard]] bool read(T& object) {
    const char* from = take(sizeof(T));
    if (from != nullptr) std::memcpy(&object, from, sizeof(T));
    return from != nullptr;
  }

 private:
  const char* at_;
  std::size_t left_;
};

bool read_entry(Reader& from, CommonError& found) {
  Entry entry;
  if (!from.read(entry) || entry.columns == 0 || entry.columns > kMaxLoadingColumns) return false;
  if (entry.name_bytes == 0 || entry.name_bytes > kMaxIdBytes) return false;
  const char* loading = from.take(bytes_of_loading(entry.columns));
  const char* name = from.take(entry.name_bytes);
  if (loading == nullptr || name == nullptr) return false;
  found.source.assign(name, entry.name_bytes);
  found.subtracts = entry.subtracts != 0;
  found.loading.resize(Eigen::NoChange, entry.columns);
  std::memcpy(found.loading.data(), loading, bytes_of_loading(entry.columns));
  return true;
}

}  // namespace

bool read_flat(const char* block, std::size_t bytes, std::size_t& most, Correlation& found) {
  Reader from(block, bytes);
  FlatCorrelation head;
  if (!from.read(head) || head.common_errors > most) return false;
  most -= head.common_errors;
  found.unknown = head.unknown != 0;
  found.observed_with.resize(head.observed != 0 ? 1 : 0);
  found.common_errors.clear();
  for (std::uint32_t i = 0; i < head.common_errors; ++i) {
    if (!read_entry(from, found.common_errors.emplace_back())) return false;
  }
  return true;
}

SharedCorrelation::SharedCorrelation(Arena& arena, Correlation correlation) : arena_(&arena) {
  if (arena.shared()) {
    FlatCorrelation head;
    head.bytes = static_cast<std::uint32_t>(flat_bytes(correlation));
    head.common_errors = static_cast<std::uint32_t>(correlation.common_errors.size());
    head.unknown = correlation.unknown ? 1 : 0;
    head.observed = correlation.observed_with.empty() ? 0 : 1;
    void* block = arena.allocate(head.bytes);
    Writer to(block);
    to.put(&head, sizeof(head));
    for (const CommonError& one : correlation.common_errors) {
      const auto columns = static_cast<std::uint32_t>(one.loading.cols());
      const Entry entry{columns, static_cast<std::uint32_t>(one.source.size()),
                        one.subtracts ? std::uint64_t{1} : 0};
      to.put(&entry, sizeof(entry));
      to.put(one.loading.data(), bytes_of_loading(columns));
      to.put(one.source.data(), one.source.size());
    }
    flat_ = static_cast<const FlatCorrelation*>(block);
  }
  own_.reset(new Correlation(std::move(correlation)));
}

SharedCorrelation::~SharedCorrelation() {
  if (flat_ == nullptr) return;
  // NOLINTNEXTLINE(*-const-cast): only readers see it as constant
  arena_->release(const_cast<FlatCorrelation*>(flat_), flat_->bytes);
}

std::size_t SharedCorrelation::bytes() const {
  if (!exists()) return 0;
  const Correlation& own = **this;
  std::size_t bytes = sizeof(own) + (flat_ != nullptr ? flat_->bytes : 0);
  for (const CommonError& one : own.common_errors) {
    bytes += sizeof(one) + static_cast<std::size_t>(one.loading.size()) * sizeof(double);
  }
  for (const std::string& id : own.observed_with) bytes += sizeof(id) + id.size();
  return bytes;
}

}  // namespace tfdude
