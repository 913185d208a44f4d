#include "recording/zstd.hpp"

#include <zstd.h>

namespace tfdude::recording {

struct Compressor::Context {
  ZSTD_CCtx* zstd = ZSTD_createCCtx();
  Context() = default;
  ~Context() { ZSTD_freeCCtx(zstd); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
};

Compressor::Compressor(int level) : context_(std::make_unique<Context>()), level_(level) {}
Compressor::~Compressor() = default;

std::string_view Compressor::compress(std::string_view raw) {
  const std::size_t most = ZSTD_compressBound(raw.size());
  if (out_.size() < most) out_.resize(most);
  const std::size_t size =
      ZSTD_compressCCtx(context_->zstd, out_.data(), out_.size(), raw.data(), raw.size(), level_);
  // Fails only for lack of memory, as the output has room for the worst case.
  if (ZSTD_isError(size) != 0) return {};
  return std::string_view(out_).substr(0, size);
}

Result<std::string> decompress(std::string_view bytes, std::size_t size) {
  const unsigned long long said = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (said == ZSTD_CONTENTSIZE_ERROR || (said != ZSTD_CONTENTSIZE_UNKNOWN && said > size)) {
    return fail(Errc::kConfig, "is not compressed as it says");
  }
  std::string raw(size, '\0');
  const std::size_t found = ZSTD_decompress(raw.data(), raw.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(found) != 0) {
    return fail(Errc::kConfig, std::string("zstd: ") + ZSTD_getErrorName(found));
  }
  if (found != size) {
    return fail(Errc::kConfig,
                "has " + std::to_string(found) + " bytes instead of " + std::to_string(size));
  }
  return raw;
}

}  // namespace tfdude::recording
