#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/result.hpp"

#include "recording/mcap.hpp"
#include "recording/zstd.hpp"

namespace tfdude::recording {

/// Writes an MCAP file: chunks with their indices and CRCs, then a summary. Knows nothing of
/// transforms. What was flushed can be read even if nothing is written after it.
/// @par Memory  One chunk, and about 100 bytes for each chunk written.
/// @par Thread safety  One thread at a time.
class McapWriter {
 public:
  /// Writes bytes at the end of the file.
  using Sink = std::function<Result<void>(std::string_view)>;

  struct Settings {
    std::string profile;
    std::string library;
    bool compress = true;
    int level = 1;                                    ///< of zstd
    std::size_t chunk_bytes = std::size_t{1} << 20U;  ///< before compression
  };

  McapWriter(Sink sink, Settings settings);

  /// Each of these fails as the sink does, and then always.
  [[nodiscard]] Result<void> start();
  [[nodiscard]] Result<void> add_schema(const Schema& schema);
  [[nodiscard]] Result<void> add_channel(const Channel& channel);
  [[nodiscard]] Result<void> add_metadata(const Metadata& metadata);
  /// Messages of chunks that are full are flushed.
  [[nodiscard]] Result<void> write(const Message& message);
  /// Ends the chunk.
  [[nodiscard]] Result<void> flush();
  /// Writes the summary. Nothing can be written afterwards.
  [[nodiscard]] Result<void> finish();

  /// The size of the file.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// The bytes of all messages, before compression.
  [[nodiscard]] std::uint64_t raw_size() const { return raw_size_; }
  [[nodiscard]] std::uint64_t messages() const { return messages_; }
  /// Whether messages wait in a chunk.
  [[nodiscard]] bool pending() const { return !chunk_.empty(); }

 private:
  using Offsets = std::vector<std::pair<std::int64_t, std::uint64_t>>;  // time, offset in the chunk
  struct ChunkIndex {
    std::int64_t start = 0;
    std::int64_t end = 0;
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
    std::vector<std::pair<std::uint16_t, std::uint64_t>> indices;  // channel, offset in the file
    std::uint64_t indices_length = 0;
    std::uint64_t compressed = 0;
    std::uint64_t raw = 0;
  };

  [[nodiscard]] Result<void> put(std::string_view bytes);
  [[nodiscard]] Result<void> put_record(Op op, std::string_view body);
  void index_chunk(ChunkIndex& index, std::string& bytes);
  [[nodiscard]] std::string statistics() const;
  [[nodiscard]] std::string summary(std::string& offsets) const;

  const Sink sink_;
  const Settings settings_;
  Compressor compressor_;
  Result<void> state_;
  std::uint64_t size_ = 0;
  std::uint64_t raw_size_ = 0;
  std::uint64_t messages_ = 0;
  std::uint32_t data_crc_ = 0;
  std::int64_t start_ = 0;
  std::int64_t end_ = 0;
  std::string chunk_;
  std::int64_t chunk_start_ = 0;
  std::int64_t chunk_end_ = 0;
  std::map<std::uint16_t, Offsets> offsets_;
  std::map<std::uint16_t, std::uint32_t> sequences_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::string schemas_;   // records
  std::string channels_;  // records
  std::uint16_t schema_count_ = 0;
  std::uint32_t channel_count_ = 0;
  std::vector<ChunkIndex> chunks_;
  std::string metadata_indices_;  // records
  std::uint32_t metadata_count_ = 0;
};

}  // namespace tfdude::recording
