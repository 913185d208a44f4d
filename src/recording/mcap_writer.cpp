#include "recording/mcap_writer.hpp"

#include <algorithm>

#include "base/bytes.hpp"
#include "recording/crc32.hpp"

namespace tfdude::recording {
namespace {

void append_record(std::string& out, Op op, std::string_view body) {
  ByteWriter writer(out);
  writer.u8(static_cast<std::uint8_t>(op));
  writer.u64(body.size());
  out.append(body);
}

void put_map(ByteWriter& writer, std::string& out,
             const std::map<std::string, std::string>& values) {
  const std::size_t at = writer.size();
  writer.u32(0);
  for (const auto& [key, value] : values) {
    writer.text(key);
    writer.text(value);
  }
  writer.set_u32(at, static_cast<std::uint32_t>(out.size() - at - 4));
}

// Appends a group of summary records, and where it lies.
void put_group(std::string& summary, std::string& offsets, std::uint64_t begin, Op op,
               std::string_view records) {
  if (records.empty()) return;
  std::string body;
  ByteWriter writer(body);
  writer.u8(static_cast<std::uint8_t>(op));
  writer.u64(begin + summary.size());
  writer.u64(records.size());
  append_record(offsets, Op::kSummaryOffset, body);
  summary.append(records);
}

}  // namespace

McapWriter::McapWriter(Sink sink, Settings settings)
    : sink_(std::move(sink)), settings_(std::move(settings)), compressor_(settings_.level) {}

Result<void> McapWriter::put(std::string_view bytes) {
  if (!state_) return state_;
  state_ = sink_(bytes);
  if (!state_) return state_;
  size_ += bytes.size();
  data_crc_ = crc32(bytes, data_crc_);
  return {};
}

Result<void> McapWriter::put_record(Op op, std::string_view body) {
  std::string record;
  append_record(record, op, body);
  return put(record);
}

Result<void> McapWriter::start() {
  std::string body;
  ByteWriter writer(body);
  writer.text(settings_.profile);
  writer.text(settings_.library);
  std::string bytes(kMagic);
  append_record(bytes, Op::kHeader, body);
  return put(bytes);
}

Result<void> McapWriter::add_schema(const Schema& schema) {
  std::string body;
  ByteWriter writer(body);
  writer.u16(schema.id);
  writer.text(schema.name);
  writer.text(schema.encoding);
  writer.text(schema.data);
  append_record(schemas_, Op::kSchema, body);
  ++schema_count_;
  return put_record(Op::kSchema, body);
}

Result<void> McapWriter::add_channel(const Channel& channel) {
  std::string body;
  ByteWriter writer(body);
  writer.u16(channel.id);
  writer.u16(channel.schema);
  writer.text(channel.topic);
  writer.text(channel.encoding);
  put_map(writer, body, channel.metadata);
  append_record(channels_, Op::kChannel, body);
  ++channel_count_;
  return put_record(Op::kChannel, body);
}

Result<void> McapWriter::add_metadata(const Metadata& metadata) {
  if (auto ok = flush(); !ok) return ok;
  std::string body;
  ByteWriter writer(body);
  writer.text(metadata.name);
  put_map(writer, body, metadata.values);
  std::string index;
  ByteWriter entry(index);
  entry.u64(size_);
  entry.u64(kRecordHead + body.size());
  entry.text(metadata.name);
  append_record(metadata_indices_, Op::kMetadataIndex, index);
  ++metadata_count_;
  return put_record(Op::kMetadata, body);
}

Result<void> McapWriter::write(const Message& message) {
  if (!state_) return state_;
  if (chunk_.empty()) chunk_start_ = chunk_end_ = message.log_time;
  chunk_start_ = std::min(chunk_start_, message.log_time);
  chunk_end_ = std::max(chunk_end_, message.log_time);
  if (messages_ == 0) start_ = end_ = message.log_time;
  start_ = std::min(start_, message.log_time);
  end_ = std::max(end_, message.log_time);
  offsets_[message.channel].emplace_back(message.log_time, chunk_.size());
  ByteWriter writer(chunk_);
  writer.u8(static_cast<std::uint8_t>(Op::kMessage));
  writer.u64(22 + message.data.size());
  writer.u16(message.channel);
  writer.u32(sequences_[message.channel]++);
  writer.u64(static_cast<std::uint64_t>(message.log_time));
  writer.u64(static_cast<std::uint64_t>(message.publish_time));
  chunk_.append(message.data);
  ++messages_;
  ++counts_[message.channel];
  raw_size_ += message.data.size();
  return chunk_.size() >= settings_.chunk_bytes ? flush() : Result<void>();
}

// The records of the message index, one for each channel.
void McapWriter::index_chunk(ChunkIndex& index, std::string& bytes) {
  const std::size_t begin = bytes.size();
  for (auto& [channel, offsets] : offsets_) {
    if (offsets.empty()) continue;
    index.indices.emplace_back(channel, size_ + bytes.size());
    std::string body;
    ByteWriter writer(body);
    writer.u16(channel);
    writer.u32(static_cast<std::uint32_t>(offsets.size() * 16));
    for (const auto& [time, offset] : offsets) {
      writer.u64(static_cast<std::uint64_t>(time));
      writer.u64(offset);
    }
    append_record(bytes, Op::kMessageIndex, body);
    offsets.clear();
  }
  index.indices_length = bytes.size() - begin;
}

Result<void> McapWriter::flush() {
  if (!state_ || chunk_.empty()) return state_;
  const std::string_view packed =
      settings_.compress ? compressor_.compress(chunk_) : std::string_view(chunk_);
  if (packed.empty()) {
    state_ = fail(Errc::kInvalidInput, "no memory to compress a chunk");
    return state_;
  }
  std::string bytes;
  bytes.reserve(packed.size() + 4096);
  ByteWriter writer(bytes);
  const std::string_view compression = settings_.compress ? "zstd" : "";
  writer.u8(static_cast<std::uint8_t>(Op::kChunk));
  writer.u64(8 + 8 + 8 + 4 + 4 + compression.size() + 8 + packed.size());
  writer.u64(static_cast<std::uint64_t>(chunk_start_));
  writer.u64(static_cast<std::uint64_t>(chunk_end_));
  writer.u64(chunk_.size());
  writer.u32(crc32(chunk_));
  writer.text(compression);
  writer.u64(packed.size());
  bytes.append(packed);
  ChunkIndex index{chunk_start_, chunk_end_, size_,         bytes.size(),
                   {},           0,          packed.size(), chunk_.size()};
  index_chunk(index, bytes);
  chunk_.clear();
  if (auto ok = put(bytes); !ok) return ok;
  chunks_.push_back(std::move(index));
  return {};
}

std::string McapWriter::statistics() const {
  std::string body;
  ByteWriter writer(body);
  writer.u64(messages_);
  writer.u16(schema_count_);
  writer.u32(channel_count_);
  writer.u32(0);  // attachments
  writer.u32(metadata_count_);
  writer.u32(static_cast<std::uint32_t>(chunks_.size()));
  writer.u64(static_cast<std::uint64_t>(start_));
  writer.u64(static_cast<std::uint64_t>(end_));
  writer.u32(static_cast<std::uint32_t>(counts_.size() * 10));
  for (const auto& [channel, count] : counts_) {
    writer.u16(channel);
    writer.u64(count);
  }
  std::string record;
  append_record(record, Op::kStatistics, body);
  return record;
}

// Grouped by kind; the channels come before the statistics.
std::string McapWriter::summary(std::string& offsets) const {
  std::string all;
  put_group(all, offsets, size_, Op::kSchema, schemas_);
  put_group(all, offsets, size_, Op::kChannel, channels_);
  put_group(all, offsets, size_, Op::kStatistics, statistics());
  std::string indices;
  for (const ChunkIndex& chunk : chunks_) {
    std::string body;
    ByteWriter writer(body);
    writer.u64(static_cast<std::uint64_t>(chunk.start));
    writer.u64(static_cast<std::uint64_t>(chunk.end));
    writer.u64(chunk.offset);
    writer.u64(chunk.length);
    writer.u32(static_cast<std::uint32_t>(chunk.indices.size() * 10));
    for (const auto& [channel, offset] : chunk.indices) {
      writer.u16(channel);
      writer.u64(offset);
    }
    writer.u64(chunk.indices_length);
    writer.text(settings_.compress ? "zstd" : "");
    writer.u64(chunk.compressed);
    writer.u64(chunk.raw);
    append_record(indices, Op::kChunkIndex, body);
  }
  put_group(all, offsets, size_, Op::kChunkIndex, indices);
  put_group(all, offsets, size_, Op::kMetadataIndex, metadata_indices_);
  return all;
}

Result<void> McapWriter::finish() {
  if (auto ok = flush(); !ok) return ok;
  std::string end;
  ByteWriter(end).u32(data_crc_);
  if (auto ok = put_record(Op::kDataEnd, end); !ok) return ok;
  std::string offsets;
  std::string bytes = summary(offsets);
  const std::uint64_t summary_start = size_;
  const std::uint64_t offset_start = size_ + bytes.size();
  bytes += offsets;
  ByteWriter writer(bytes);
  writer.u8(static_cast<std::uint8_t>(Op::kFooter));
  writer.u64(kFooterRecord - kRecordHead);
  writer.u64(summary_start);
  writer.u64(offset_start);
  writer.u32(crc32(bytes));
  bytes.append(kMagic);
  if (auto ok = put(bytes); !ok) return ok;
  state_ = fail(Errc::kInvalidInput, "the file is finished");
  return {};
}

}  // namespace tfdude::recording
