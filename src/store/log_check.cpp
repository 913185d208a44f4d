#include "store/log_check.hpp"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <sys/stat.h>
#include <vector>

#include "tfdude/base/id.hpp"

// The layout: "WAL-mode File Format" of SQLite.
namespace tfdude {
namespace {

constexpr std::size_t kHeader = 32;
constexpr std::size_t kFrameHeader = 24;
constexpr std::uint32_t kMagic = 0x377f0682;  // the last bit: checksums are of big-endian words

using Bytes = std::vector<unsigned char>;

std::uint32_t big_endian(const unsigned char* at) {
  return std::uint32_t{at[0]} << 24U | std::uint32_t{at[1]} << 16U | std::uint32_t{at[2]} << 8U |
         std::uint32_t{at[3]};
}
std::uint32_t little_endian(const unsigned char* at) {
  return std::uint32_t{at[3]} << 24U | std::uint32_t{at[2]} << 16U | std::uint32_t{at[1]} << 8U |
         std::uint32_t{at[0]};
}

// Continues over all frames.
class Checksum {
 public:
  explicit Checksum(bool big) : word_(big ? big_endian : little_endian) {}

  void add(const unsigned char* bytes, std::size_t size) {
    for (std::size_t i = 0; i < size; i += 8) {
      first_ += word_(bytes + i) + second_;
      second_ += word_(bytes + i + 4) + first_;
    }
  }
  // As it is stored.
  [[nodiscard]] bool is(const unsigned char* at) const {
    return big_endian(at) == first_ && big_endian(at + 4) == second_;
  }

 private:
  std::uint32_t (*word_)(const unsigned char*);
  std::uint32_t first_ = 0;
  std::uint32_t second_ = 0;
};

// Unknown is false.
bool written_since_boot(const std::string& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return false;
  std::ifstream about("/proc/stat");
  for (std::string word; about >> word;) {
    std::int64_t boot = 0;  // [s] by the computer's clock as it is now
    if (word == "btime" && about >> boot) return status.st_mtim.tv_sec >= boot;
  }
  return false;
}

bool read(std::ifstream& log, Bytes& bytes) {
  return static_cast<bool>(
      log.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())));
}

bool is_page_size(std::uint32_t size) {
  return size >= 512 && size <= 65536 && (size & (size - 1)) == 0;
}

}  // namespace

std::optional<DamagedLog> find_damage(const std::string& log) {
  std::ifstream in(log, std::ios::binary);
  Bytes header(kHeader);
  if (!in || !written_since_boot(log) || !read(in, header)) return std::nullopt;
  const std::uint32_t magic = big_endian(header.data());
  const std::uint32_t page = big_endian(&header[8]);
  Checksum sum((magic & 1U) != 0);
  sum.add(header.data(), 24);
  // SQLite ignores all of a log whose header fails.
  const bool whole =
      (magic & ~std::uint32_t{1}) == kMagic && is_page_size(page) && sum.is(&header[24]);
  DamagedLog damaged;
  if (!whole)
    return in.peek() == std::ifstream::traits_type::eof() ? std::nullopt : std::optional(damaged);
  Bytes frame(kFrameHeader + page);
  bool intact = true;
  for (std::uint64_t number = 1; read(in, frame); ++number) {
    // Older ones are left from before the log was begun again.
    const bool current = std::equal(&header[16], &header[24], &frame[8]);
    const bool commits = big_endian(&frame[4]) != 0;
    if (intact) {
      sum.add(frame.data(), 8);
      sum.add(&frame[kFrameHeader], page);
      intact = current && big_endian(frame.data()) != 0 && sum.is(&frame[16]);
      if (!intact) damaged.frame = number;
    } else if (current && commits) {
      ++damaged.commits;
    }
  }
  return damaged.commits > 0 ? std::optional(damaged) : std::nullopt;
}

std::string to_string(const DamagedLog& damaged, const std::string& log) {
  if (damaged.frame == 0) return "the header of " + quote(log) + ", and all changes behind it";
  return "frame " + std::to_string(damaged.frame) + " of " + quote(log) + ", and " +
         std::to_string(damaged.commits) + " or more changes behind it";
}

}  // namespace tfdude
