#include <algorithm>

#include "base/bytes.hpp"
#include "recording/crc32.hpp"
#include "recording/mcap_reader.hpp"

// Where the chunks of an MCAP file lie: by its summary or, without one, by looking at all records.
namespace tfdude::recording {
namespace {

constexpr std::uint64_t kLooseBytes = std::uint64_t{1} << 22U;
constexpr std::size_t kMessageHead = 22;
// The part of a chunk that is needed to find it: its times.
constexpr std::size_t kChunkTimes = 16;

std::string at_byte(std::uint64_t offset) { return "at byte " + std::to_string(offset); }

}  // namespace

// @return whether the summary says where all messages are
Result<bool> McapReader::read_summary() {
  const std::uint64_t size = source_->size();
  const std::uint64_t tail = kFooterRecord + kMagic.size();
  if (size < data_begin_ + tail) {
    problems_.emplace_back("it has no end: its writer was interrupted, or still writes");
    return false;
  }
  const auto bytes = window_->at(size - tail, static_cast<std::size_t>(tail));
  if (!bytes) return tl::unexpected(bytes.error());
  ByteReader reader(*bytes);
  const bool footer = static_cast<Op>(reader.u8()) == Op::kFooter && reader.u64() == 20;
  const std::uint64_t start = reader.u64();
  (void)reader.u64();  // summary offsets
  const std::uint32_t crc = reader.u32();
  if (!footer || bytes->substr(kFooterRecord) != kMagic) {
    problems_.emplace_back("it has no end: its writer was interrupted, or still writes");
    return false;
  }
  finished_ = true;
  if (start == 0) return false;
  const auto good = check_summary(start, crc);
  if (!good || !*good) return good;
  const std::uint64_t end = size - tail;
  std::uint64_t offset = start;
  while (offset < end) {
    const auto record = record_at(offset, end);
    if (!record) return tl::unexpected(record.error());
    if (!*record) break;
    if (auto ok = read_summary_record(**record); !ok) return tl::unexpected(std::move(ok.error()));
    offset += kRecordHead + (*record)->length;
  }
  const bool all = !chunks_.empty() || message_count_ == 0U;
  if (!all) message_count_.reset();
  return all;
}

Result<bool> McapReader::check_summary(std::uint64_t start, std::uint32_t crc) {
  const std::uint64_t end = source_->size() - kMagic.size() - 4;  // of what the CRC covers
  if (start < data_begin_ || start > end) {
    problems_.emplace_back("its summary lies outside of the file");
    return false;
  }
  if (crc == 0) return true;
  std::uint32_t found = 0;
  std::string bytes;
  for (std::uint64_t offset = start; offset < end;) {
    const auto count = static_cast<std::size_t>(std::min(end - offset, kLooseBytes));
    if (auto ok = source_->read(offset, count, bytes); !ok) return tl::unexpected(ok.error());
    found = crc32(bytes, found);
    offset += count;
  }
  if (found != crc) problems_.emplace_back("its summary has a wrong CRC");
  return found == crc;
}

Result<void> McapReader::read_summary_record(const Record& record) {
  switch (record.op) {
    case Op::kSchema:
    case Op::kChannel: {
      const auto bytes = body(record);
      return bytes ? read_names(record.op, *bytes) : Result<void>(tl::unexpected(bytes.error()));
    }
    case Op::kStatistics: {
      const auto bytes = body(record);
      if (!bytes) return tl::unexpected(bytes.error());
      ByteReader reader(*bytes);
      message_count_ = reader.u64();
      return {};
    }
    case Op::kChunkIndex: {
      const auto bytes = body(record);
      if (!bytes) return tl::unexpected(bytes.error());
      ByteReader reader(*bytes);
      ChunkPlace chunk;
      chunk.start = reader.number<std::int64_t>();
      chunk.end = reader.number<std::int64_t>();
      chunk.offset = reader.u64();
      chunk.length = reader.u64();
      ByteReader channels(reader.text());
      while (channels.left() >= 10) {
        chunk.channels.push_back(channels.u16());
        (void)channels.u64();
      }
      if (!reader.good()) return {};
      return add_chunk(std::move(chunk));
    }
    case Op::kMetadataIndex: {
      const auto bytes = body(record);
      if (!bytes) return tl::unexpected(bytes.error());
      ByteReader reader(*bytes);
      const auto place = record_at(reader.u64(), source_->size());
      if (!place || !*place || (*place)->op != Op::kMetadata) return {};
      const auto metadata = body(**place);
      return metadata ? read_names(Op::kMetadata, *metadata) : Result<void>();
    }
    default:
      return {};
  }
}

Result<void> McapReader::scan() {
  chunks_.clear();
  metadata_.clear();
  const std::uint64_t size = source_->size();
  std::uint64_t offset = data_begin_;
  while (offset < size) {
    if (size - offset == kMagic.size() && finished_) return {};
    const auto record = record_at(offset, size);
    if (!record) return tl::unexpected(record.error());
    if (!*record || static_cast<std::uint8_t>((*record)->op) == 0) {
      problems_.push_back("the record " + at_byte(offset) + " is damaged, or the last one is cut");
      break;
    }
    const auto more = scan_record(**record);
    if (!more) return tl::unexpected(more.error());
    if (!*more) return {};
    offset += kRecordHead + (*record)->length;
  }
  // Of the last index, records may be missing.
  if (!chunks_.empty()) chunks_.back().channels.clear();
  return {};
}

// @return whether there may be more
Result<bool> McapReader::scan_record(const Record& record) {
  switch (record.op) {
    case Op::kDataEnd:
    case Op::kFooter:
      return false;
    case Op::kSchema:
    case Op::kChannel:
    case Op::kMetadata: {
      const auto bytes = body(record);
      if (!bytes) return tl::unexpected(bytes.error());
      return read_names(record.op, *bytes).map([] { return true; });
    }
    case Op::kChunk:
      return add_scanned_chunk(record).map([] { return true; });
    case Op::kMessage:
      return add_loose_message(record).map([] { return true; });
    case Op::kMessageIndex: {
      if (record.length < 2 || chunks_.empty() || chunks_.back().loose) return true;
      const auto bytes = window_->at(record.offset + kRecordHead, 2);
      if (!bytes) return tl::unexpected(bytes.error());
      chunks_.back().channels.push_back(ByteReader(*bytes).u16());
      return count_names(sizeof(std::uint16_t)).map([] { return true; });
    }
    default:
      return true;
  }
}

Result<void> McapReader::add_scanned_chunk(const Record& record) {
  if (record.length < kChunkTimes) return {};
  const auto bytes = window_->at(record.offset + kRecordHead, kChunkTimes);
  if (!bytes) return tl::unexpected(bytes.error());
  ByteReader reader(*bytes);
  ChunkPlace chunk;
  chunk.offset = record.offset;
  chunk.length = kRecordHead + record.length;
  chunk.start = reader.number<std::int64_t>();
  chunk.end = reader.number<std::int64_t>();
  return add_chunk(std::move(chunk));
}

Result<void> McapReader::add_loose_message(const Record& record) {
  if (record.length < kMessageHead) return {};
  const auto bytes = window_->at(record.offset + kRecordHead, kMessageHead);
  if (!bytes) return tl::unexpected(bytes.error());
  ByteReader reader(*bytes);
  (void)reader.bytes(6);
  const auto time = reader.number<std::int64_t>();
  const std::uint64_t length = kRecordHead + record.length;
  if (!chunks_.empty() && chunks_.back().loose) {
    ChunkPlace& run = chunks_.back();
    if (run.offset + run.length == record.offset && run.length + length <= kLooseBytes) {
      run.length += length;
      run.start = std::min(run.start, time);
      run.end = std::max(run.end, time);
      return {};
    }
  }
  return add_chunk({record.offset, length, time, time, {}, true, true});
}

}  // namespace tfdude::recording
