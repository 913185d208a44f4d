#include "transport/fastdds/outgoing.hpp"

#include <algorithm>
#include <cstring>

#include "transport/fastdds/rtps_layout.hpp"

namespace tfdude::fastdds {
namespace {

// In DATA with its header (RTPS 2.2, section 9.4.5.3), and that of announcements (9.3.1.3).
constexpr std::size_t kDataWriterAt = 12;
constexpr std::uint8_t kParticipantWriter[] = {0x00, 0x01, 0x00, 0xC2};

// Of Fast DDS (its RTPSStatisticsMessages.hpp): it finds its submessage by the number at this place
// before the end, and then writes into it.
constexpr std::uint8_t kStatistics = 0x80;
constexpr std::uint32_t kStatisticsSize = 60;

bool ends_with_statistics(const std::uint8_t* datagram, std::uint32_t size) {
  return size >= rtps::kHeader + kStatisticsSize && datagram[size - kStatisticsSize] == kStatistics;
}

std::size_t length_of(const std::uint8_t* submessage) {
  const std::size_t low = submessage[2];
  const std::size_t high = submessage[3];
  return (submessage[1] & rtps::kLittleEndian) != 0 ? low | high << 8U : high | low << 8U;
}

}  // namespace

std::uint32_t size_without_statistics(const std::uint8_t* datagram, std::uint32_t size) {
  if (!ends_with_statistics(datagram, size)) return size;
  const std::uint32_t rest = size - kStatisticsSize;
  const std::uint8_t* statistics = datagram + rest;
  if (length_of(statistics) + rtps::kSubmessageHeader != kStatisticsSize) return size;
  // Otherwise Fast DDS would overwrite what follows the number.
  return ends_with_statistics(datagram, rest) ? size : rest;
}

bool is_announcement(const std::uint8_t* datagram, std::size_t size) {
  for (std::size_t at = rtps::kHeader; at + rtps::kSubmessageHeader <= size;) {
    const std::uint8_t* submessage = datagram + at;
    const std::size_t length = length_of(submessage);
    if (submessage[0] == rtps::kData) {
      return at + kDataWriterAt + sizeof(kParticipantWriter) <= size &&
             (submessage[1] & rtps::kDataFlag) != 0 &&
             std::memcmp(submessage + kDataWriterAt, kParticipantWriter,
                         sizeof(kParticipantWriter)) == 0;
    }
    if (length == 0) return false;  // the last one, or without content
    at += rtps::kSubmessageHeader + length;
  }
  return false;
}

bool AnnouncementPace::may_send(const ertps::SenderResource* through, const ertps::Locator_t& to,
                                Clock::time_point now) {
  const Clock::duration pause = client_ ? Clock::duration(kFirst) : Clock::duration(kTwice);
  const auto [known, first] = sent_.try_emplace({through, to}, Sent{now, pause});
  if (first) return true;
  Sent& sent = known->second;
  if (now - sent.last < sent.pause) return false;
  sent.last = now;
  if (client_) sent.pause = std::min<Clock::duration>(2 * sent.pause, kLongest);
  return true;
}

}  // namespace tfdude::fastdds
