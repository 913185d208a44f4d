#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"

namespace tfdude::recording {

/// A file to read from any place.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Replaces the content of `out`. @return kConfig, also if there are not so many bytes
  [[nodiscard]] virtual Result<void> read(std::uint64_t offset, std::size_t count,
                                          std::string& out) const = 0;
};

/// A file on disk, with the size that it has now. @return kConfig, naming it
[[nodiscard]] Result<std::unique_ptr<ByteSource>> open_source(const std::string& file);

/// Bytes in memory.
class TextSource final : public ByteSource {
 public:
  explicit TextSource(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  [[nodiscard]] Result<void> read(std::uint64_t offset, std::size_t count,
                                  std::string& out) const override;

 private:
  std::string bytes_;
};

/// Small reads of a source, in the order of their places: reads ahead.
class SourceWindow {
 public:
  explicit SourceWindow(const ByteSource& source) : source_(source) {}

  /// The bytes, valid until the next call. @return as ByteSource::read()
  [[nodiscard]] Result<std::string_view> at(std::uint64_t offset, std::size_t count);

 private:
  static constexpr std::size_t kAhead = std::size_t{1} << 16U;
  const ByteSource& source_;
  std::uint64_t begin_ = 0;
  std::string bytes_;
};

}  // namespace tfdude::recording
