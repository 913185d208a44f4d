#include "store/correlation_blob.hpp"

#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

constexpr std::uint32_t kRows = 6;

class Writer {
 public:
  void byte(bool value) { blob_ += value ? '\1' : '\0'; }
  void count(std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    raw(&number, sizeof number);
  }
  void text(const std::string& value) {
    count(value.size());
    blob_ += value;
  }
  void loading(const Loading& value) {
    count(static_cast<std::size_t>(value.cols()));
    raw(value.data(), static_cast<std::size_t>(value.size()) * sizeof(double));
  }
  [[nodiscard]] std::string take() { return std::move(blob_); }

 private:
  void raw(const void* data, std::size_t size) {
    blob_.append(static_cast<const char*>(data), size);
  }

  std::string blob_;
};

// A value that is cut short reads as zero or empty, and makes the whole blob invalid.
class Reader {
 public:
  explicit Reader(std::string_view rest) : rest_(rest) {}

  bool byte() {
    char value = 0;
    raw(&value, 1);
    good_ = good_ && (value == 0 || value == 1);
    return value == 1;
  }
  // @param most  a greater count is invalid
  std::uint32_t count(std::size_t most) {
    std::uint32_t value = 0;
    raw(&value, sizeof value);
    good_ = good_ && value <= most;
    return good_ ? value : 0;
  }
  std::string text() {
    std::string value(count(rest_.size()), '\0');
    raw(value.data(), value.size());
    return value;
  }
  Loading loading() {
    Loading value = Loading::Zero(kRows, count(static_cast<std::size_t>(kMaxLoadingColumns)));
    raw(value.data(), static_cast<std::size_t>(value.size()) * sizeof(double));
    return value;
  }
  [[nodiscard]] bool ended_well() const { return good_ && rest_.empty(); }

 private:
  void raw(void* to, std::size_t size) {
    good_ = good_ && size <= rest_.size();
    if (!good_ || size == 0) return;
    std::memcpy(to, rest_.data(), size);
    rest_.remove_prefix(size);
  }

  std::string_view rest_;
  bool good_ = true;
};

}  // namespace

std::string to_blob(const Correlation& correlation) {
  Writer writer;
  writer.byte(correlation.unknown);
  writer.count(correlation.common_errors.size());
  for (const CommonError& common_error : correlation.common_errors) {
    writer.text(common_error.source);
    writer.byte(common_error.subtracts);
    writer.loading(common_error.loading);
  }
  writer.count(correlation.observed_with.size());
  for (const std::string& id : correlation.observed_with) writer.text(id);
  return writer.take();
}

Result<Correlation> correlation_from(const std::string& blob) {
  Reader reader(blob);
  Correlation correlation;
  correlation.unknown = reader.byte();
  const std::uint32_t common_errors = reader.count(kMaxCommonErrors);
  for (std::uint32_t i = 0; i < common_errors; ++i) {
    std::string source = reader.text();
    const bool subtracts = reader.byte();
    correlation.common_errors.push_back({std::move(source), subtracts, reader.loading()});
  }
  const std::uint32_t others = reader.count(kMaxCommonErrors);
  for (std::uint32_t i = 0; i < others; ++i) correlation.observed_with.push_back(reader.text());
  if (!reader.ended_well()) {
    return fail(Errc::kState, "a correlation of " + std::to_string(blob.size()) + " bytes");
  }
  if (auto ok = check_common_errors(correlation.common_errors); !ok)
    return tl::unexpected(std::move(ok.error()));
  for (const std::string& id : correlation.observed_with) {
    if (auto ok = check_id(id, "an edge observed with it"); !ok) return tl::unexpected(ok.error());
  }
  return correlation;
}

}  // namespace tfdude
