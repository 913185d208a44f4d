#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"

namespace tfdude::recording {

/// Compresses with zstd; keeps its memory between calls.
class Compressor {
 public:
  /// @param level  of zstd: 1 is fast
  explicit Compressor(int level);
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  /// The compressed bytes; valid until the next call.
  [[nodiscard]] std::string_view compress(std::string_view raw);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
  std::string out_;
  int level_;
};

/// @param size  of the result, which is all that is allocated
/// @return kConfig: the bytes are damaged, or of another size
[[nodiscard]] Result<std::string> decompress(std::string_view bytes, std::size_t size);

}  // namespace tfdude::recording
