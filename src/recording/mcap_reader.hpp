#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/result.hpp"

#include "recording/byte_source.hpp"
#include "recording/mcap.hpp"

namespace tfdude::recording {

/// Where messages lie in a file.
struct ChunkPlace {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::int64_t start = 0;  ///< of the log times [ns]
  std::int64_t end = 0;
  std::vector<std::uint16_t> channels{};  ///< of its messages; empty: not known
  bool loose = false;                     ///< messages that are not in a chunk
  bool names_read = false;                ///< by learn_channels()
};

/// Reads an MCAP file of any origin. What can be read of a damaged one is read, and problems() says
/// what is wrong. Knows nothing of transforms.
/// @par Memory  About 100 bytes for each chunk, of at most kMaxChunks, and one chunk of at most
///   kMaxChunkBytes.
/// @par Thread safety  One thread at a time.
class McapReader {
 public:
  static constexpr std::size_t kMaxChunks = std::size_t{1} << 22U;
  static constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 26U;
  /// Of other records, such as schemas; and of all schemas and metadata together.
  static constexpr std::uint64_t kMaxRecordBytes = std::uint64_t{1} << 24U;
  static constexpr std::uint64_t kMaxNamesBytes = std::uint64_t{1} << 26U;

  /// @return kConfig: it cannot be read, or is no MCAP file; kTooMuch: it exceeds a limit
  [[nodiscard]] static Result<McapReader> open(std::unique_ptr<ByteSource> source);

  /// Sorted by their place in the file.
  [[nodiscard]] const std::vector<ChunkPlace>& chunks() const { return chunks_; }
  /// In a file without a summary, those of a chunk are known after learn_channels().
  [[nodiscard]] const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  /// Null: unknown.
  [[nodiscard]] const Schema* schema(std::uint16_t id) const;
  [[nodiscard]] const std::vector<Metadata>& metadata() const { return metadata_; }
  [[nodiscard]] const std::string& profile() const { return profile_; }
  [[nodiscard]] const std::string& library() const { return library_; }
  [[nodiscard]] std::uint64_t size() const { return source_->size(); }
  /// Whether the file ends as its writer wanted, with a summary.
  [[nodiscard]] bool finished() const { return finished_; }
  /// The number of messages, if the file has a summary that gives it.
  [[nodiscard]] std::optional<std::uint64_t> message_count() const { return message_count_; }
  /// Sentences for people.
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }

  /// Makes known which channels the messages of a chunk have, and these channels, if it or a chunk
  /// before it tells them: mostly the one with the first message. Reads no chunk twice for it.
  /// @return as read(), of a chunk that was read for it
  [[nodiscard]] Result<void> learn_channels(std::size_t chunk);

  /// Calls a function for each message of a chunk, in order; it returns whether to go on.
  /// @return kConfig: the chunk is damaged (nothing of it was visited) or ends early; kUnsupported:
  ///   its compression; kTooMuch: its size
  using Visit = std::function<bool(const Message&)>;
  [[nodiscard]] Result<void> read(const ChunkPlace& chunk, const Visit& visit);

 private:
  struct Record {
    Op op{};
    std::uint64_t offset = 0;  // of its head
    std::uint64_t length = 0;  // of its body
  };
  explicit McapReader(std::unique_ptr<ByteSource> source) : source_(std::move(source)) {}

  [[nodiscard]] Result<void> read_header();
  [[nodiscard]] Result<bool> read_summary();
  [[nodiscard]] Result<bool> check_summary(std::uint64_t start, std::uint32_t crc);
  [[nodiscard]] Result<void> read_summary_record(const Record& record);
  [[nodiscard]] Result<void> scan();
  [[nodiscard]] Result<bool> scan_record(const Record& record);
  [[nodiscard]] Result<void> add_scanned_chunk(const Record& record);
  [[nodiscard]] Result<void> add_loose_message(const Record& record);
  [[nodiscard]] Result<void> add_chunk(ChunkPlace chunk);
  void drop_overlapping();
  [[nodiscard]] Result<std::optional<Record>> record_at(std::uint64_t offset, std::uint64_t end);
  [[nodiscard]] Result<std::string_view> body(const Record& record);
  [[nodiscard]] Result<void> read_names(ChunkPlace& chunk);
  [[nodiscard]] bool knows_channels(const ChunkPlace& chunk) const;
  [[nodiscard]] Result<void> count_names(std::uint64_t bytes);
  [[nodiscard]] Result<void> read_names(Op op, std::string_view body);
  [[nodiscard]] Result<void> visit_records(std::string_view records, const Visit& visit);

  std::unique_ptr<ByteSource> source_;
  std::unique_ptr<SourceWindow> window_;
  std::string profile_;
  std::string library_;
  std::uint64_t data_begin_ = 0;
  std::vector<ChunkPlace> chunks_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<Metadata> metadata_;
  std::uint64_t names_bytes_ = 0;
  std::size_t names_read_ = 0;  // chunks whose names are read, from the first one on
  bool finished_ = false;
  std::optional<std::uint64_t> message_count_;
  std::vector<std::string> problems_;
};

}  // namespace tfdude::recording
