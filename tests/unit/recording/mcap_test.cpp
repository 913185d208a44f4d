#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

#include "base/bytes.hpp"
#include "recording/crc32.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/mcap_writer.hpp"
#include "support/catch.hpp"

using namespace tfdude;
using namespace tfdude::recording;

namespace {

struct Read {
  std::uint16_t channel;
  std::int64_t log_time;
  std::string data;
};

std::string bytes_of(int number) { return "message " + std::to_string(number); }

// Messages 0, 1, ... on two channels, several chunks, metadata.
std::string written(int messages, bool compress, bool finish = true) {
  std::string file;
  McapWriter writer(
      [&](std::string_view bytes) {
        file += bytes;
        return Result<void>();
      },
      {"ros2", "test", compress, 1, 200});
  REQUIRE(writer.start());
  REQUIRE(writer.add_schema({1, "a/msg/A", "ros2msg", "int32 x"}));
  REQUIRE(writer.add_channel({1, 1, "/a", "cdr", {{"key", "value"}}}));
  REQUIRE(writer.add_channel({2, 1, "/b", "cdr", {}}));
  for (int i = 0; i < messages; ++i) {
    const std::string data = bytes_of(i);
    REQUIRE(writer.write({static_cast<std::uint16_t>(1 + i % 2), 1000 - i, i, data}));
  }
  REQUIRE(writer.add_metadata({"meta", {{"x", "1"}}}));
  if (!finish) {
    REQUIRE(writer.flush());
    return file;
  }
  REQUIRE(writer.finish());
  REQUIRE(file.size() == writer.size());
  CHECK_FALSE(writer.write({1, 0, 0, "late"}));
  return file;
}

Result<McapReader> opened(std::string_view bytes) {
  return McapReader::open(std::make_unique<TextSource>(bytes));
}

std::vector<Read> all_of(McapReader& reader) {
  std::vector<Read> all;
  for (const ChunkPlace& chunk : reader.chunks()) {
    (void)reader.read(chunk, [&](const Message& message) {
      all.push_back({message.channel, message.log_time, std::string(message.data)});
      return true;
    });
  }
  return all;
}

void check_all(const std::string& bytes, int messages) {
  auto reader = opened(bytes);
  REQUIRE(reader);
  const auto all = all_of(*reader);
  REQUIRE(all.size() == static_cast<std::size_t>(messages));
  for (int i = 0; i < messages; ++i) {
    CHECK(all[static_cast<std::size_t>(i)].data == bytes_of(i));
    CHECK(all[static_cast<std::size_t>(i)].log_time == 1000 - i);
  }
  REQUIRE(reader->channels().count(1) == 1);
  CHECK(reader->channels().at(1).topic == "/a");
  CHECK(reader->channels().at(1).metadata.at("key") == "value");
  REQUIRE(reader->schema(1) != nullptr);
  CHECK(reader->schema(1)->data == "int32 x");
  CHECK(reader->metadata().size() == 1);
  CHECK(reader->profile() == "ros2");
}

void append(std::string& out, Op op, const std::string& body) {
  ByteWriter writer(out);
  writer.u8(static_cast<std::uint8_t>(op));
  writer.u64(body.size());
  out += body;
}

}  // namespace

TEST_CASE("mcap: the CRC is that of IEEE 802.3, also in parts") {
  CHECK(crc32("123456789") == 0xCBF43926U);
  CHECK(crc32("6789", crc32("12345")) == 0xCBF43926U);
  CHECK(crc32("") == 0U);
  const std::string text(1000, 'x');
  CHECK(crc32(std::string_view(text).substr(13), crc32(text.substr(0, 13))) == crc32(text));
}

TEST_CASE("mcap: the CRC of many bytes is that of the same bytes one by one") {
  std::string text;
  std::uint32_t one_by_one = 0;
  for (int i = 0; i < 400; ++i) {
    CAPTURE(i);
    CHECK(crc32(text) == one_by_one);
    text.push_back(static_cast<char>(i * 89 + 7));
    one_by_one = crc32(std::string_view(text).substr(text.size() - 1), one_by_one);
  }
}

TEST_CASE("mcap: what is written is read, with and without compression, also without a summary") {
  const bool compress = GENERATE(false, true);
  const int messages = GENERATE(0, 1, 100);
  check_all(written(messages, compress), messages);
  const std::string torn = written(messages, compress, false);
  check_all(torn, messages);
  CHECK_FALSE(opened(torn)->finished());
  CHECK(opened(written(messages, compress))->problems().empty());
}

TEST_CASE("mcap: an independent reader accepts the file") {
  const auto path = std::filesystem::temp_directory_path() /
                    ("tfdude-mcap-" + std::to_string(getpid()) + ".mcap");
  for (const bool compress : {false, true}) {
    std::ofstream(path, std::ios::binary) << written(100, compress);
    CHECK(std::system(("python3 " TFDUDE_MCAP_CHECK " " + path.string()).c_str()) == 0);
    std::string damaged = written(100, compress);
    damaged[150] ^= 1;
    std::ofstream(path, std::ios::binary) << damaged;
    CHECK(std::system(("python3 " TFDUDE_MCAP_CHECK " " + path.string() + " 2>&1").c_str()) != 0);
  }
  std::filesystem::remove(path);
}

TEST_CASE("mcap: a file that is cut anywhere is read up to its last whole chunk") {
  const std::string whole = written(60, true);
  std::size_t before = 0;
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    auto reader = opened(std::string_view(whole).substr(0, size));
    if (!reader) {
      CHECK(size < 8);
      continue;
    }
    const auto all = all_of(*reader);
    CHECK(all.size() >= before);
    before = all.size();
    for (std::size_t i = 0; i < all.size(); ++i)
      CHECK(all[i].data == bytes_of(static_cast<int>(i)));
    if (size < whole.size()) CHECK_FALSE(reader->problems().empty());
  }
  CHECK(before == 60);
}

TEST_CASE("mcap: a changed byte never gives a wrong message of a chunk") {
  const std::string whole = written(40, true);
  for (std::size_t place = 0; place < whole.size(); ++place) {
    std::string bytes = whole;
    bytes[place] = static_cast<char>(bytes[place] ^ 0x40);
    auto reader = opened(bytes);
    if (!reader) continue;
    for (const Read& read : all_of(*reader)) {
      const int number = std::atoi(read.data.substr(8).c_str());
      CHECK(read.data == bytes_of(number));
      CHECK(read.log_time == 1000 - number);
    }
  }
}

TEST_CASE(
    "mcap: messages without chunks, chunks of other kinds, and foreign records are no trouble") {
  std::string bytes(kMagic);
  append(bytes, Op::kHeader, std::string(8, '\0'));
  std::string channel;
  ByteWriter fields(channel);
  fields.u16(7);
  fields.u16(0);
  fields.text("/x");
  fields.text("json");
  fields.text("");
  append(bytes, Op::kChannel, channel);
  append(bytes, static_cast<Op>(0x80), "unknown");
  for (int i = 0; i < 3; ++i) {
    std::string message;
    ByteWriter writer(message);
    writer.u16(7);
    writer.u32(0);
    writer.u64(static_cast<std::uint64_t>(i));
    writer.u64(0);
    append(bytes, Op::kMessage, message + bytes_of(i));
  }
  std::string chunk;
  ByteWriter writer(chunk);
  writer.u64(0);
  writer.u64(0);
  writer.u64(4);
  writer.u32(0);
  writer.text("lz4");
  writer.u64(4);
  append(bytes, Op::kChunk, chunk + "1234");
  auto reader = opened(bytes);
  REQUIRE(reader);
  REQUIRE(reader->chunks().size() == 2);
  CHECK(all_of(*reader).size() == 3);
  CHECK(reader->chunks()[0].loose);
  const auto read = reader->read(reader->chunks()[1], [](const Message&) { return true; });
  REQUIRE_FALSE(read);
  CHECK(read.error().code == Errc::kUnsupported);
}

TEST_CASE("mcap: sizes that do not fit are refused before memory is taken for them") {
  std::string bytes(kMagic);
  append(bytes, Op::kHeader, std::string(8, '\0'));
  SECTION("a chunk that claims a terabyte") {
    std::string chunk;
    ByteWriter writer(chunk);
    writer.u64(0);
    writer.u64(0);
    writer.u64(std::uint64_t{1} << 40U);
    writer.u32(0);
    writer.text("zstd");
    writer.u64(4);
    append(bytes, Op::kChunk, chunk + "1234");
    auto reader = opened(bytes);
    REQUIRE(reader);
    REQUIRE(reader->chunks().size() == 1);
    const auto read = reader->read(reader->chunks()[0], [](const Message&) { return true; });
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::kTooMuch);
  }
  SECTION("a record that claims more than the file") {
    ByteWriter writer(bytes);
    writer.u8(static_cast<std::uint8_t>(Op::kSchema));
    writer.u64(UINT64_MAX);
    CHECK(opened(bytes)->chunks().empty());
  }
  SECTION("a summary that begins outside of the file, or within its footer") {
    const std::uint64_t start = GENERATE(UINT64_MAX, 1U, 1000U);
    std::string footer;
    ByteWriter writer(footer);
    writer.u64(start);
    writer.u64(0);
    writer.u32(0);
    append(bytes, Op::kFooter, footer);
    bytes += kMagic;
    auto reader = opened(bytes);
    REQUIRE(reader);
    CHECK(reader->chunks().empty());
  }
}

namespace {

// A file of any size of which only the ends are in memory: an index of 29-byte records.
class EndlessIndex final : public ByteSource {
 public:
  explicit EndlessIndex(std::uint64_t records) : records_(records) {
    head_ = std::string(kMagic);
    append(head_, Op::kHeader, std::string(8, '\0'));
    std::string body(8 + 8 + 8 + 8, '\0');
    body += std::string(4, '\0') + std::string(8, '\0') + std::string(4, '\0');
    body += std::string(16, '\0');
    append(record_, Op::kChunkIndex, body);
    ByteWriter footer(tail_);
    std::string fields;
    ByteWriter writer(fields);
    writer.u64(head_.size());
    writer.u64(0);
    writer.u32(0);
    append(tail_, Op::kFooter, fields);
    tail_ += kMagic;
  }
  [[nodiscard]] std::uint64_t size() const override {
    return head_.size() + records_ * record_.size() + tail_.size();
  }
  [[nodiscard]] Result<void> read(std::uint64_t offset, std::size_t count,
                                  std::string& out) const override {
    out.clear();
    while (out.size() < count) out += from(offset + out.size()).substr(0, count - out.size());
    return {};
  }

 private:
  // Up to the end of the head, of a record or of the tail.
  [[nodiscard]] std::string_view from(std::uint64_t offset) const {
    if (offset < head_.size()) return std::string_view(head_).substr(offset);
    offset -= head_.size();
    const std::uint64_t of_records = records_ * record_.size();
    if (offset < of_records) return std::string_view(record_).substr(offset % record_.size());
    return std::string_view(tail_).substr(offset - of_records);
  }

  std::uint64_t records_;
  std::string head_;
  std::string record_;
  std::string tail_;
};

}  // namespace

TEST_CASE("mcap: an index of a billion records is refused, with bounded memory") {
  const auto reader = McapReader::open(std::make_unique<EndlessIndex>(1'000'000'000));
  REQUIRE_FALSE(reader);
  CHECK(reader.error().code == Errc::kTooMuch);
}

// A small file could otherwise have one chunk unpacked without end.
TEST_CASE("mcap: a chunk that the summary names many times is read once") {
  const std::string whole = written(100, true);
  // The index of the first chunk again and again, in the summary. Without its CRC.
  const std::size_t footer = whole.size() - 8 - 29;
  ByteReader end(std::string_view(whole).substr(footer + 9));
  const std::uint64_t summary = end.u64();
  std::string records = whole.substr(summary, footer - summary);
  std::string index;
  for (std::size_t at = 0; at < records.size() && index.empty();) {
    ByteReader reader(std::string_view(records).substr(at));
    const auto op = static_cast<Op>(reader.u8());
    const std::uint64_t length = reader.u64();
    if (op == Op::kSummaryOffset) break;
    if (op == Op::kChunkIndex) index = records.substr(at, 9 + length);
    at += 9 + length;
  }
  REQUIRE_FALSE(index.empty());
  std::string many = whole.substr(0, summary);
  for (int i = 0; i < 1000; ++i) many += index;
  many += records;
  std::string tail;
  ByteWriter writer(tail);
  writer.u64(summary);
  writer.u64(0);
  writer.u32(0);
  append(many, Op::kFooter, tail);
  many += whole.substr(whole.size() - 8);
  auto reader = opened(many);
  REQUIRE(reader);
  CHECK(all_of(*reader).size() == 100);
  REQUIRE_FALSE(reader->problems().empty());
  CHECK(reader->problems().back() == "1000 chunks are named more than once, or lie in another one");
}

TEST_CASE("mcap: the writer stops with the error of its sink") {
  int calls = 0;
  McapWriter writer(
      [&](std::string_view) -> Result<void> {
        if (++calls < 4) return {};
        return fail(Errc::kState, "no space");
      },
      {"", "", true, 1, 10});
  REQUIRE(writer.start());
  REQUIRE(writer.add_schema({1, "a", "ros2msg", ""}));
  REQUIRE(writer.add_channel({1, 1, "/a", "cdr", {}}));
  const auto failed = writer.write({1, 0, 0, "more than ten bytes"});
  REQUIRE_FALSE(failed);
  CHECK(failed.error().message == "no space");
  CHECK(writer.finish().error().message == "no space");
  CHECK(calls == 4);
}
