#include "recording/mcap_reader.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/bytes.hpp"
#include "recording/crc32.hpp"
#include "recording/zstd.hpp"

namespace tfdude::recording {
namespace {

// Of a chunk, before its messages; the name of a compression is short.
constexpr std::uint64_t kChunkHead = 128;

std::map<std::string, std::string> map_of(std::string_view bytes) {
  std::map<std::string, std::string> values;
  ByteReader reader(bytes);
  while (reader.good() && reader.left() > 0) {
    const std::string_view key = reader.text();
    const std::string_view value = reader.text();
    if (reader.good()) values.emplace(key, value);
  }
  return values;
}

}  // namespace

Result<McapReader> McapReader::open(std::unique_ptr<ByteSource> source) {
  McapReader reader(std::move(source));
  reader.window_ = std::make_unique<SourceWindow>(*reader.source_);
  if (auto ok = reader.read_header(); !ok) return tl::unexpected(std::move(ok.error()));
  const auto summary = reader.read_summary();
  if (!summary) return tl::unexpected(summary.error());
  if (!*summary) {
    if (auto ok = reader.scan(); !ok) return tl::unexpected(std::move(ok.error()));
  }
  std::stable_sort(reader.chunks_.begin(), reader.chunks_.end(),
                   [](const ChunkPlace& a, const ChunkPlace& b) { return a.offset < b.offset; });
  reader.drop_overlapping();
  return reader;
}

// Chunks of a file lie one after the other. An index that names one several times would have it
// read as often.
void McapReader::drop_overlapping() {
  std::uint64_t end = 0;
  const auto overlaps = [&end](const ChunkPlace& chunk) {
    if (chunk.offset < end) return true;
    end = chunk.offset + std::min(chunk.length, UINT64_MAX - chunk.offset);
    return false;
  };
  const auto kept = std::remove_if(chunks_.begin(), chunks_.end(), overlaps);
  if (kept == chunks_.end()) return;
  problems_.push_back(std::to_string(chunks_.end() - kept) +
                      " chunks are named more than once, or lie in another one");
  chunks_.erase(kept, chunks_.end());
}

const Schema* McapReader::schema(std::uint16_t id) const {
  const auto found = schemas_.find(id);
  return found != schemas_.end() ? &found->second : nullptr;
}

// The record whose head lies here; none if it does not end before `end`.
Result<std::optional<McapReader::Record>> McapReader::record_at(std::uint64_t offset,
                                                                std::uint64_t end) {
  if (offset > end || end - offset < kRecordHead) return std::nullopt;
  const auto head = window_->at(offset, kRecordHead);
  if (!head) return tl::unexpected(head.error());
  ByteReader reader(*head);
  Record record{static_cast<Op>(reader.u8()), offset, 0};
  record.length = reader.u64();
  if (record.length > end - offset - kRecordHead) return std::nullopt;
  return record;
}

Result<std::string_view> McapReader::body(const Record& record) {
  if (record.length > kMaxRecordBytes) {
    return fail(Errc::kTooMuch, "a record at byte " + std::to_string(record.offset) + " has " +
                                    std::to_string(record.length) + " bytes");
  }
  return window_->at(record.offset + kRecordHead, static_cast<std::size_t>(record.length));
}

Result<void> McapReader::read_header() {
  const auto magic = window_->at(0, kMagic.size());
  if (!magic || *magic != kMagic) return fail(Errc::kConfig, "it is no MCAP file");
  const auto record = record_at(kMagic.size(), source_->size());
  if (!record) return tl::unexpected(record.error());
  data_begin_ = kMagic.size();
  if (!*record || (*record)->op != Op::kHeader) {
    problems_.emplace_back("there is no header");
    return {};
  }
  const auto bytes = body(**record);
  if (!bytes) return tl::unexpected(bytes.error());
  ByteReader reader(*bytes);
  profile_ = reader.text();
  library_ = reader.text();
  data_begin_ += kRecordHead + (*record)->length;
  return {};
}

Result<void> McapReader::count_names(std::uint64_t bytes) {
  names_bytes_ += bytes;
  if (names_bytes_ <= kMaxNamesBytes) return {};
  return fail(Errc::kTooMuch, "its schemas, channels and metadata have more than " +
                                  std::to_string(kMaxNamesBytes) + " bytes");
}

// What is known already counts once, however often its chunk is read.
Result<void> McapReader::read_names(Op op, std::string_view bytes) {
  ByteReader reader(bytes);
  if (op == Op::kSchema) {
    Schema schema;
    schema.id = reader.u16();
    if (schemas_.count(schema.id) == 1) return {};
    schema.name = reader.text();
    schema.encoding = reader.text();
    schema.data = reader.text();
    if (!reader.good()) return {};
    return count_names(bytes.size()).map([&] { schemas_.emplace(schema.id, std::move(schema)); });
  }
  if (op == Op::kChannel) {
    Channel channel;
    channel.id = reader.u16();
    if (channels_.count(channel.id) == 1) return {};
    channel.schema = reader.u16();
    channel.topic = reader.text();
    channel.encoding = reader.text();
    channel.metadata = map_of(reader.text());
    if (!reader.good()) return {};
    return count_names(bytes.size()).map([&] {
      channels_.emplace(channel.id, std::move(channel));
    });
  }
  Metadata metadata;
  metadata.name = reader.text();
  metadata.values = map_of(reader.text());
  if (!reader.good()) return {};
  return count_names(bytes.size()).map([&] { metadata_.push_back(std::move(metadata)); });
}

bool McapReader::knows_channels(const ChunkPlace& chunk) const {
  return std::all_of(chunk.channels.begin(), chunk.channels.end(),
                     [this](std::uint16_t channel) { return channels_.count(channel) == 1; });
}

Result<void> McapReader::learn_channels(std::size_t chunk) {
  Result<void> all;
  const ChunkPlace& wanted = chunks_[chunk];
  const auto is_known = [&] { return wanted.names_read || !wanted.channels.empty(); };
  if (is_known() && knows_channels(wanted)) return all;
  // Backwards: a channel may have begun in a chunk that was left out, long before it is used.
  for (std::size_t i = chunk + 1; i-- > names_read_;) {
    if (chunks_[i].names_read) continue;
    if (auto ok = read_names(chunks_[i]); !ok) all = std::move(ok);
    if (knows_channels(wanted)) return all;
  }
  names_read_ = std::max(names_read_, chunk + 1);
  return all;
}

Result<void> McapReader::read_names(ChunkPlace& chunk) {
  chunk.names_read = true;
  std::set<std::uint16_t> channels;
  auto ok = read(chunk, [&](const Message& message) {
    channels.insert(message.channel);
    return true;
  });
  if (!chunk.channels.empty()) return ok;
  chunk.channels.assign(channels.begin(), channels.end());
  const auto counted = count_names(channels.size() * sizeof(std::uint16_t));
  return ok ? counted : ok;
}

Result<void> McapReader::add_chunk(ChunkPlace chunk) {
  if (chunks_.size() >= kMaxChunks) {
    return fail(Errc::kTooMuch, "it has more than " + std::to_string(kMaxChunks) + " chunks");
  }
  chunks_.push_back(std::move(chunk));
  return count_names(chunks_.back().channels.size() * sizeof(std::uint16_t));
}

Result<void> McapReader::read(const ChunkPlace& chunk, const Visit& visit) {
  const std::string where = "the chunk at byte " + std::to_string(chunk.offset);
  if (chunk.length > kMaxChunkBytes + kChunkHead) {
    return fail(Errc::kTooMuch, where + " has " + std::to_string(chunk.length) + " bytes");
  }
  std::string bytes;
  if (auto ok = source_->read(chunk.offset, static_cast<std::size_t>(chunk.length), bytes); !ok) {
    return ok;
  }
  if (chunk.loose) return visit_records(bytes, visit);
  ByteReader reader(bytes);
  const auto op = static_cast<Op>(reader.u8());
  const std::uint64_t length = reader.u64();
  (void)reader.bytes(16);  // times
  const std::uint64_t raw_size = reader.u64();
  const std::uint32_t crc = reader.u32();
  const std::string_view compression = reader.text();
  const std::string_view packed = reader.bytes(reader.u64());
  if (!reader.good() || op != Op::kChunk || length != bytes.size() - kRecordHead) {
    return fail(Errc::kConfig, where + " is damaged");
  }
  if (raw_size > kMaxChunkBytes) {
    return fail(Errc::kTooMuch, where + " has " + std::to_string(raw_size) + " bytes");
  }
  std::string unpacked;
  std::string_view raw = packed;
  if (compression == "zstd") {
    auto result = decompress(packed, static_cast<std::size_t>(raw_size));
    if (!result) return fail_at(where, result.error());
    unpacked = *std::move(result);
    raw = unpacked;
  } else if (!compression.empty()) {
    return fail(Errc::kUnsupported,
                where + " is compressed with " + quote(compression) + "; only zstd can be read");
  }
  if (raw.size() != raw_size) return fail(Errc::kConfig, where + " has another size than it says");
  if (crc != 0 && crc32(raw) != crc) return fail(Errc::kConfig, where + " has a wrong CRC");
  return visit_records(raw, visit);
}

Result<void> McapReader::visit_records(std::string_view records, const Visit& visit) {
  ByteReader reader(records);
  while (reader.left() > 0) {
    const auto op = static_cast<Op>(reader.u8());
    const std::string_view bytes = reader.bytes(reader.u64());
    if (!reader.good()) return fail(Errc::kConfig, "a record reaches beyond the end of its chunk");
    if (op == Op::kSchema || op == Op::kChannel) {
      if (auto ok = read_names(op, bytes); !ok) return ok;
      continue;
    }
    if (op != Op::kMessage) continue;
    ByteReader fields(bytes);
    Message message;
    message.channel = fields.u16();
    (void)fields.u32();  // sequence number
    message.log_time = fields.number<std::int64_t>();
    message.publish_time = fields.number<std::int64_t>();
    if (!fields.good()) return fail(Errc::kConfig, "a message is shorter than its fields");
    message.data = fields.bytes(fields.left());
    if (!visit(message)) return {};
  }
  return {};
}

}  // namespace tfdude::recording
