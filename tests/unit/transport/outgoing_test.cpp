#include "transport/fastdds/outgoing.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kInfoTimestamp = 0x09;
constexpr std::uint8_t kData = 0x15;
constexpr std::uint8_t kStatistics = 0x80;

Bytes header() {
  Bytes bytes{'R', 'T', 'P', 'S', 2, 3, 1, 15};
  bytes.resize(20, 7);
  return bytes;
}

void append(Bytes& bytes, std::uint8_t kind, std::uint8_t flags, std::size_t length) {
  bytes.insert(bytes.end(), {kind, flags, static_cast<std::uint8_t>(length & 0xFFU),
                             static_cast<std::uint8_t>(length >> 8U)});
  bytes.resize(bytes.size() + length, 0x11);
}

// DATA of a writer with this key and kind in its id.
void append_data(Bytes& bytes, std::uint8_t flags, std::uint8_t key, std::uint8_t kind) {
  const std::size_t at = bytes.size();
  append(bytes, kData, flags, 400);
  const Bytes writer{0, key, 0, kind};
  std::copy(writer.begin(), writer.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at) + 12);
}

std::uint32_t without_statistics(const Bytes& bytes) {
  return size_without_statistics(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
}

bool announces(const Bytes& bytes) { return is_announcement(bytes.data(), bytes.size()); }

ertps::Locator_t locator(std::uint32_t port) {
  ertps::Locator_t to;
  to.port = port;
  return to;
}

}  // namespace

TEST_CASE("outgoing: the statistics at the end of a datagram are not needed") {
  Bytes bytes = header();
  append(bytes, kInfoTimestamp, 1, 8);
  append_data(bytes, 5, 0, 3);
  const auto rest = static_cast<std::uint32_t>(bytes.size());
  CHECK(without_statistics(bytes) == rest);
  append(bytes, kStatistics, 1, 56);
  CHECK(without_statistics(bytes) == rest);
  bytes[rest + 2] = 52;
  CHECK(without_statistics(bytes) == bytes.size());
  CHECK(without_statistics(header()) == 20);
  CHECK(without_statistics({}) == 0);
}

TEST_CASE("outgoing: no datagram is shortened in which Fast DDS would then find statistics") {
  Bytes bytes = header();
  append_data(bytes, 5, 0, 3);
  bytes[bytes.size() - 60] = kStatistics;
  append(bytes, kStatistics, 1, 56);
  CHECK(without_statistics(bytes) == bytes.size());
}

TEST_CASE("outgoing: an announcement is data of the writer of participants") {
  Bytes bytes = header();
  append(bytes, kInfoTimestamp, 1, 8);
  Bytes of_endpoint = bytes;
  Bytes leaving = bytes;
  append_data(bytes, 5, 1, 0xC2);
  CHECK(announces(bytes));
  append_data(of_endpoint, 5, 0, 0xC2);
  CHECK_FALSE(announces(of_endpoint));
  append_data(leaving, 1 | 2 | 8, 1, 0xC2);  // the key only
  CHECK_FALSE(announces(leaving));
  for (std::size_t size = 0; size < 48; ++size) CHECK_FALSE(is_announcement(bytes.data(), size));
}

TEST_CASE("outgoing: a client announces itself at longer and longer intervals") {
  AnnouncementPace pace(true);
  const auto start = AnnouncementPace::Clock::now();
  std::vector<int> sent;
  for (int ms = 0; ms < 40; ms += 2) {
    if (pace.may_send(nullptr, locator(1), start + milliseconds(ms))) sent.push_back(ms);
  }
  CHECK(sent == std::vector<int>{0, 6, 16, 36});
  CHECK(pace.may_send(nullptr, locator(2), start + milliseconds(1)));
  // All of the later ones.
  for (int ms = 340; ms < 3000; ms += 300)
    CHECK(pace.may_send(nullptr, locator(1), start + milliseconds(ms)));
}

TEST_CASE("outgoing: an owner's announcement is sent once to one address") {
  AnnouncementPace pace(false);
  const auto start = AnnouncementPace::Clock::now();
  CHECK(pace.may_send(nullptr, locator(1), start));
  CHECK_FALSE(pace.may_send(nullptr, locator(1), start + microseconds(30)));
  CHECK(pace.may_send(nullptr, locator(2), start + microseconds(30)));
  for (int ms = 1; ms < 10; ++ms) {
    CHECK(pace.may_send(nullptr, locator(1), start + milliseconds(ms)));
  }
}

TEST_CASE("outgoing: an announcement is sent through the socket of each interface") {
  AnnouncementPace pace(false);
  const auto start = AnnouncementPace::Clock::now();
  int interfaces[2];
  for (int& one : interfaces) {
    // Only its address counts.
    const auto* socket = reinterpret_cast<const ertps::SenderResource*>(&one);
    CHECK(pace.may_send(socket, locator(1), start));
    CHECK_FALSE(pace.may_send(socket, locator(1), start + microseconds(30)));
  }
}

}  // namespace tfdude::fastdds
