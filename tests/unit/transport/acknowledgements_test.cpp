// What readers have acknowledged, read from their datagrams.

#include "transport/fastdds/acknowledgements.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;
using Clock = std::chrono::steady_clock;

const PeerId kReader{1, 15, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
const Acknowledgements::WriterId kWriter{0, 0, 7, 3};

// A message with a submessage before the acknowledgement, as Fast DDS sends it: INFO_DST.
Bytes acknack(const PeerId& from, std::uint64_t missing, bool little) {
  Bytes bytes{'R', 'T', 'P', 'S', 2, 3, 1, 15};
  bytes.insert(bytes.end(), from.begin(), from.end());
  const auto put = [&](std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) {
      const int shift = 8 * (little ? i : size - 1 - i);
      bytes.push_back(static_cast<std::uint8_t>(value >> shift));
    }
  };
  const std::uint8_t flags = little ? 1 : 0;
  bytes.insert(bytes.end(), {0x0E, flags});
  put(12, 2);
  bytes.insert(bytes.end(), 12, 0xAA);
  bytes.insert(bytes.end(), {0x06, flags});
  put(24, 2);
  bytes.insert(bytes.end(), {0, 0, 7, 4});
  bytes.insert(bytes.end(), kWriter.begin(), kWriter.end());
  put(missing >> 32U, 4);
  put(missing & 0xFFFFFFFFU, 4);
  put(0, 4);  // none of the next ones
  put(1, 4);  // the count
  return bytes;
}

}  // namespace

TEST_CASE("acknowledgements: a wait ends when the reader misses only later samples") {
  const bool little = GENERATE(true, false);
  const std::uint64_t number = GENERATE(std::uint64_t{1}, std::uint64_t{0xFFFFFFFF});
  CAPTURE(little, number);
  Acknowledgements acknowledgements;
  const PeerId other{9};
  auto waiting = std::async(std::launch::async, [&] {
    return acknowledgements.wait_until(kReader, kWriter, number, Clock::now() + 30s);
  });
  const auto hear = [&](const Bytes& datagram) {
    acknowledgements.heard(datagram.data(), datagram.size());
  };
  for (int i = 0; i < 10; ++i) {
    hear(acknack(other, number + 1, little));
    hear(acknack(kReader, number, little));
    CHECK(waiting.wait_for(2ms) == std::future_status::timeout);
  }
  while (waiting.wait_for(1ms) == std::future_status::timeout) {
    hear(acknack(kReader, number + 1, little));
  }
  CHECK(waiting.get());
}

TEST_CASE("acknowledgements: a wait ends at its deadline, and damaged datagrams do no harm") {
  Acknowledgements acknowledgements;
  auto waiting = std::async(std::launch::async, [&] {
    return acknowledgements.wait_until(kReader, kWriter, 5, Clock::now() + 100ms);
  });
  const Bytes whole = acknack(kReader, 5, true);
  while (waiting.wait_for(1ms) == std::future_status::timeout) {
    for (std::size_t size = 0; size <= whole.size(); ++size) {
      const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      acknowledgements.heard(cut.data(), cut.size());
    }
  }
  CHECK_FALSE(waiting.get());
}

}  // namespace tfdude::fastdds
