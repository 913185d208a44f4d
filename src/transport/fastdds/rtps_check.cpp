#include "transport/fastdds/rtps_check.hpp"

#include <algorithm>
#include <cstring>
#include <endian.h>
#include <functional>
#include <utility>

#include "transport/fastdds/rtps_layout.hpp"

namespace tfdude::fastdds {
namespace {

using Flaw = DatagramFlaw;
using Kind = NumberClaim::Kind;

constexpr NumberClaim::Entity kAnnouncer{0x00, 0x01, 0x00, 0xC2};
constexpr NumberClaim::Entity kHandshaker{0x00, 0x02, 0x01, 0xC3};

constexpr std::uint8_t kInvalidate = 0x02;  // of INFO_TS
constexpr std::uint8_t kInlineQos = 0x02;
constexpr std::uint8_t kKeyFlag = 0x08;
constexpr std::uint8_t kKeyFlagOfFragments = 0x04;
constexpr std::uint64_t kMaxNumber = (std::uint64_t{1} << 63U) - 1;

// Reads numbers and skips bytes; after an attempt to go beyond the end it is not good.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size, bool little)
      : at_(data), end_(data + size), little_(little) {}

  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }
  [[nodiscard]] const std::uint8_t* at() const { return at_; }

  const std::uint8_t* skip(std::size_t size) {
    if (size > left()) {
      good_ = false;
      at_ = end_;
      return nullptr;
    }
    const std::uint8_t* const from = at_;
    at_ += size;
    return from;
  }
  std::uint32_t u16() {
    const std::uint8_t* const from = skip(2);
    if (from == nullptr) return 0;
    return little_ ? from[0] | from[1] << 8U : from[1] | from[0] << 8U;
  }
  std::uint32_t u32() {
    const std::uint8_t* const from = skip(4);
    if (from == nullptr) return 0;
    std::uint32_t value = 0;
    std::memcpy(&value, from, 4);
    return little_ ? le32toh(value) : be32toh(value);
  }
  std::uint64_t sequence_number() {
    const std::uint64_t high = u32();
    return high << 32U | u32();
  }
  NumberClaim::Entity entity() {
    NumberClaim::Entity entity{};
    if (const std::uint8_t* const from = skip(entity.size())) {
      std::copy_n(from, entity.size(), entity.begin());
    }
    return entity;
  }
  // As Fast DDS reads text and octets: with padding to four bytes behind, except at the end.
  void sized_bytes() {
    const std::size_t size = u32();
    skip(size);
    if (good_) skip(std::min(left(), (4 - size % 4) % 4));
  }
  // A number of elements that have at least so many bytes each.
  std::uint32_t count(std::size_t least) {
    const std::uint32_t many = u32();
    if (many > left() / least) good_ = false;
    return good_ ? many : 0;
  }

 private:
  const std::uint8_t* at_;
  const std::uint8_t* end_;
  bool little_;
  bool good_ = true;
};

// DDS Security 1.1, 7.2.4: a class, properties of two texts, and properties of a text and octets.
void data_holder(Bytes& in) {
  in.sized_bytes();
  for (int kinds = 0; kinds < 2; ++kinds) {
    for (std::uint32_t many = in.count(8); many > 0 && in.good(); --many) {
      in.sized_bytes();
      in.sized_bytes();
    }
  }
}

// The numbers of a set are in a bitmap, which starts at a base.
struct Set {
  std::uint64_t base = 0;
  std::uint32_t bits = 0;
};

constexpr std::uint32_t kMostBits = 256;

Set read_set(Bytes& in, bool of_fragments) {
  Set set;
  set.base = of_fragments ? in.u32() : in.sequence_number();
  set.bits = in.u32();
  if (set.bits <= kMostBits) in.skip((set.bits + 31) / 32 * 4);
  return set;
}

struct Submessage {
  std::uint8_t id = 0;
  std::uint8_t flags = 0;
  bool shielded = false;  // between the parts that protect a submessage
  Bytes body{nullptr, 0, true};

  [[nodiscard]] bool has(std::uint8_t flag) const { return (flags & flag) != 0; }
  [[nodiscard]] bool little() const { return has(rtps::kLittleEndian); }
};

class Check {
 public:
  Check(bool secured, NumberClaims& claims) : secured_(secured), claims_(claims), open_(!secured) {}

  Flaw run(const std::uint8_t* datagram, std::size_t size) {
    constexpr std::uint8_t kMajorVersion = 2;
    if (size < rtps::kHeader || std::memcmp(datagram, "RTPS", 4) != 0 ||
        datagram[4] != kMajorVersion) {
      return Flaw::kHeader;
    }
    std::copy_n(datagram + rtps::kPrefixAt, sender_.size(), sender_.begin());
    open_ = !secured_ || (size > rtps::kHeader && datagram[rtps::kHeader] == rtps::kMessagePrefix);
    std::size_t at = rtps::kHeader;
    bool shielded = false;
    while (at < size) {
      Submessage next;
      const std::size_t length = begin(datagram + at, size - at, next);
      if (length == 0) return Flaw::kLength;
      if (next.id == rtps::kSecurePrefix) shielded = true;
      next.shielded = shielded;
      if (const Flaw flaw = check(next); flaw != Flaw::kNone) return flaw;
      if (next.id == rtps::kSecurePostfix) shielded = false;
      at += std::min(length, size - at);
    }
    return Flaw::kNone;
  }

  // Of a datagram that was checked.
  std::vector<std::uint8_t> divide(const std::uint8_t* datagram, std::size_t size,
                                   const std::function<void(std::vector<std::uint8_t>)>& fragment) {
    const auto append = [&](std::vector<std::uint8_t>& to, std::size_t at, std::size_t length) {
      to.insert(to.end(), datagram + at, datagram + at + std::min(length, size - at));
    };
    std::copy_n(datagram + rtps::kPrefixAt, sender_.size(), sender_.begin());
    std::vector<std::uint8_t> before(datagram, datagram + rtps::kHeader);
    std::vector<std::uint8_t> rest = before;
    bool only_fragments = true;
    std::size_t length = 0;
    for (std::size_t at = rtps::kHeader; at < size; at += length) {
      Submessage next;
      length = begin(datagram + at, size - at, next);
      if (length == 0) break;
      if (next.id == rtps::kDataFragment) {
        std::vector<std::uint8_t> one = before;
        append(one, at, length);
        if (fragments(next) == Flaw::kNone) fragment(std::move(one));
        continue;
      }
      append(rest, at, length);
      if (is_of_following(next.id)) {
        append(before, at, length);
        if (next.id == rtps::kInfoSource) (void)source(next);
      } else if (next.id != rtps::kPad) {
        only_fragments = false;
      }
    }
    return only_fragments ? std::vector<std::uint8_t>() : rest;
  }

  // Of a datagram that is made here.
  void run_heartbeats(const std::uint8_t* datagram, std::size_t size) {
    for_each(datagram, size, [this](Submessage& next) {
      if (next.id == rtps::kHeartbeat) (void)heartbeat(next);
    });
  }
  void run_acknowledgements(const std::uint8_t* datagram, std::size_t size) {
    for_each(datagram, size, [this](Submessage& next) {
      if (next.id == rtps::kAckNack) (void)acknowledgement(next);
      const std::uint8_t* const to =
          next.id == rtps::kInfoDestination ? next.body.skip(sender_.size()) : nullptr;
      if (to != nullptr) std::copy_n(to, sender_.size(), sender_.begin());
    });
  }

 private:
  template <class Take>
  static void for_each(const std::uint8_t* datagram, std::size_t size, const Take& take) {
    std::size_t length = rtps::kHeader;
    for (std::size_t at = 0; length > 0 && (at += length) < size;) {
      Submessage next;
      length = begin(datagram + at, size - at, next);
      if (length > 0) take(next);
    }
  }

  // @return its length with header and padding; 0: it does not fit
  static std::size_t begin(const std::uint8_t* from, std::size_t left, Submessage& submessage) {
    constexpr std::size_t kOwnHeader = 4;
    if (left < kOwnHeader) return 0;
    submessage.id = from[0];
    submessage.flags = from[1];
    Bytes header(from + 2, 2, submessage.little());
    std::size_t length = header.u16();
    if (length > left - kOwnHeader) return 0;
    // Without a length, the last one extends to the end.
    const bool may_be_empty = submessage.id == rtps::kPad || submessage.id == rtps::kInfoTimestamp;
    if (length == 0 && !may_be_empty) length = left - kOwnHeader;
    submessage.body = Bytes(from + kOwnHeader, length, submessage.little());
    return kOwnHeader + (length + 3) / 4 * 4;
  }

  // RTPS 2.2, 8.3.7: where, from whom and when the next submessages are.
  static bool is_of_following(std::uint8_t id) {
    constexpr std::uint8_t kInfoReplyIp4 = 0x0D;
    constexpr std::uint8_t kInfoReply = 0x0F;
    return id == rtps::kInfoTimestamp || id == rtps::kInfoSource || id == rtps::kInfoDestination ||
           id == kInfoReplyIp4 || id == kInfoReply;
  }

  Flaw check(Submessage& next) {
    switch (next.id) {
      case rtps::kData:
        return data(next);
      case rtps::kDataFragment:
        return fragments(next);
      case rtps::kHeartbeat:
        return heartbeat(next);
      case rtps::kGap:
        return gap(next);
      case rtps::kAckNack:
        return acknowledgement(next);
      case rtps::kNackFragments:
        return missing_fragments(next);
      case rtps::kHeartbeatFragment:
        return fragments_exist(next);
      case rtps::kInfoSource:
        return source(next);
      case rtps::kInfoDestination:
        return at_least(next, 12);
      case rtps::kInfoTimestamp:
        return at_least(next, next.has(kInvalidate) ? 0 : 8);
      case rtps::kSecurePrefix:
      case rtps::kMessagePrefix:
        return at_least(next, 20);  // kind, key, session and vector
      case rtps::kSecureBody:
        return secure_body(next);
      default:
        return Flaw::kNone;
    }
  }

  static Flaw at_least(const Submessage& next, std::size_t size) {
    return next.body.left() >= size ? Flaw::kNone : Flaw::kLength;
  }

  static Flaw secure_body(Submessage& next) {
    Bytes body(next.body.at(), next.body.left(), false);  // always big-endian
    body.skip(body.u32());
    return body.good() ? Flaw::kNone : Flaw::kLength;
  }

  Flaw source(Submessage& next) {
    constexpr std::size_t kBeforePrefix = 8;
    if (next.body.left() != kBeforePrefix + sender_.size()) return Flaw::kLength;
    next.body.skip(kBeforePrefix);
    std::copy_n(next.body.at(), sender_.size(), sender_.begin());
    return Flaw::kNone;
  }

  // Whether these endpoints may talk unprotected.
  [[nodiscard]] bool may_talk(const Submessage& next, const NumberClaim::Entity& writer) const {
    const bool is_data = next.id == rtps::kData || next.id == rtps::kDataFragment;
    return open_ || next.shielded || (is_data && (writer == kAnnouncer || writer == kHandshaker));
  }

  Flaw admit(Kind kind, const NumberClaim::Entity& writer, std::uint64_t first, std::uint64_t last,
             std::uint32_t count = 0) {
    return admit({kind, sender_, writer, first, last, count});
  }
  Flaw admit(const NumberClaim& claim) {
    // What is protected as a whole comes from a participant with keys, or is dropped by Fast DDS.
    if (secured_ && open_) return Flaw::kNone;
    return claims_.admit(claim) ? Flaw::kNone : Flaw::kJump;
  }

  // What is before the payload, in DATA and DATA_FRAG alike; leaves the payload.
  Flaw skip_inline_qos(Bytes& in, std::size_t to_inline_qos, std::size_t read, bool has_qos) {
    if (to_inline_qos < read) return Flaw::kLength;
    in.skip(to_inline_qos - read);
    constexpr std::uint32_t kSentinel = 1;
    constexpr std::uint32_t kStatusInfo = 0x71;
    while (has_qos && in.good()) {
      const std::uint32_t id = in.u16();
      const std::uint32_t size = in.u16();
      if (id == kSentinel) break;
      if (size % 4 != 0) return Flaw::kLength;
      const std::uint8_t* const value = in.skip(size);
      // RTPS 2.2, 9.6.3.9: disposed, unregistered. The last byte has these flags.
      if (id == kStatusInfo && size == 4 && value != nullptr) disposes_ = (value[3] & 3U) != 0;
    }
    return in.good() ? Flaw::kNone : Flaw::kLength;
  }

  Flaw data(Submessage& next) {
    Bytes& in = next.body;
    in.skip(2);
    const std::size_t to_inline_qos = in.u16();
    in.entity();
    const NumberClaim::Entity writer = in.entity();
    const std::uint64_t number = in.sequence_number();
    if (!in.good()) return Flaw::kLength;
    if (!may_talk(next, writer)) return Flaw::kUnprotected;
    if (number == 0 || number > kMaxNumber) return Flaw::kNumber;
    disposes_ = false;
    if (const Flaw flaw = skip_inline_qos(in, to_inline_qos, 16, next.has(kInlineQos));
        flaw != Flaw::kNone) {
      return flaw;
    }
    if (next.has(rtps::kDataFlag) && next.has(kKeyFlag)) return Flaw::kNumber;
    const bool has_payload = next.has(rtps::kDataFlag) || next.has(kKeyFlag);
    if (has_payload && in.left() < 4) return Flaw::kLength;
    if (next.has(rtps::kDataFlag) && writer == kAnnouncer) {
      if (const Flaw flaw = announcement(in); flaw != Flaw::kNone) return flaw;
    }
    if (next.has(rtps::kDataFlag) && writer == kAnnouncer && !disposes_ &&
        !claims_.admit_participant(announced_)) {
      return Flaw::kCrowd;
    }
    const bool leaves = disposes_ || next.has(kKeyFlag);
    if (!open_ && !next.shielded && writer == kAnnouncer && leaves) return Flaw::kFarewell;
    if (next.has(rtps::kDataFlag) && writer == kHandshaker && !handshake(in)) return Flaw::kLength;
    return admit(Kind::kData, writer, number, number);
  }

  // RTPS 2.2, 10: the encapsulation of a payload.
  static Bytes without_encapsulation(Bytes in) {
    const std::uint8_t* const encapsulation = in.skip(4);
    const bool little = encapsulation != nullptr && (encapsulation[1] & 1U) != 0;
    return {in.at(), in.left(), little};
  }

  [[nodiscard]] Flaw announcement(const Bytes& payload) {
    announced_ = sender_;
    constexpr std::uint32_t kSentinel = 1;
    constexpr std::uint32_t kLease = 2;
    constexpr std::uint32_t kGuid = 0x50;
    constexpr std::array<std::uint32_t, 3> kTokens{0x1001, 0x1002, 0x1006};
    Bytes in = without_encapsulation(payload);
    while (in.good()) {
      const std::uint32_t id = in.u16();
      const std::size_t size = in.u16();
      if (id == kSentinel) break;
      const std::uint8_t* const value = in.skip(size);
      if (value == nullptr) return Flaw::kLength;
      if (id == kGuid && size >= announced_.size()) {
        std::copy_n(value, announced_.size(), announced_.begin());
      }
      if (id == kLease && !open_) {
        const auto seconds = static_cast<std::int32_t>(payload_part(payload, value, size).u32());
        if (seconds < kShortestLease) return Flaw::kNumber;
      }
      if (std::find(kTokens.begin(), kTokens.end(), id) == kTokens.end()) continue;
      Bytes token = payload_part(payload, value, size);
      data_holder(token);
      if (!token.good()) return Flaw::kLength;
    }
    return in.good() ? Flaw::kNone : Flaw::kLength;
  }

  static Bytes payload_part(const Bytes& payload, const std::uint8_t* value, std::size_t size) {
    return {value, size, (payload.at()[1] & 1U) != 0};
  }

  // DDS Security 1.1, 7.4.3: two identities of messages, three of endpoints, a class, and data.
  static bool handshake(const Bytes& payload) {
    constexpr std::size_t kIdentities = 2 * 24 + 3 * 16;
    Bytes in = without_encapsulation(payload);
    in.skip(kIdentities);
    in.sized_bytes();
    for (std::uint32_t many = in.count(12); many > 0 && in.good(); --many) data_holder(in);
    return in.good();
  }

  Flaw fragments(Submessage& next) {
    Bytes& in = next.body;
    in.skip(2);
    const std::size_t to_inline_qos = in.u16();
    in.entity();
    const NumberClaim::Entity writer = in.entity();
    const std::uint64_t number = in.sequence_number();
    const std::uint64_t first = in.u32();
    const std::uint64_t many = in.u16();
    const auto bytes = static_cast<std::uint16_t>(in.u16());
    const std::uint32_t sample = in.u32();
    if (!in.good()) return Flaw::kLength;
    if (!may_talk(next, writer)) return Flaw::kUnprotected;
    // One datagram has room for all announcements.
    if (writer == kAnnouncer) return Flaw::kLength;
    if (number == 0 || number > kMaxNumber || first == 0 || many == 0) return Flaw::kNumber;
    if (bytes < kSmallestFragment || sample == 0 || sample > kLargestSample) return Flaw::kNumber;
    const std::uint64_t from = (first - 1) * bytes;
    const std::uint64_t to = std::min<std::uint64_t>(from + many * bytes, sample);
    if (from >= sample || (first + many - 2) * bytes >= sample) return Flaw::kNumber;
    if (const Flaw flaw = skip_inline_qos(in, to_inline_qos, 28, next.has(kInlineQos));
        flaw != Flaw::kNone) {
      return flaw;
    }
    if (!next.has(kKeyFlagOfFragments) && in.left() < to - from) return Flaw::kLength;
    return admit({Kind::kFragments, sender_, writer, number, number, 0, sample, bytes,
                  static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(many)});
  }

  Flaw heartbeat(Submessage& next) {
    Bytes& in = next.body;
    in.entity();
    const NumberClaim::Entity writer = in.entity();
    const std::uint64_t first = in.sequence_number();
    const std::uint64_t last = in.sequence_number();
    const std::uint32_t count = in.u32();
    if (!in.good()) return Flaw::kLength;
    if (!may_talk(next, writer)) return Flaw::kUnprotected;
    if (first == 0 || first > kMaxNumber || last > kMaxNumber || last + 1 < first ||
        last + 1 - first > kLongestRange) {
      return Flaw::kNumber;
    }
    return admit(Kind::kHeartbeat, writer, first, last, count);
  }

  Flaw gap(Submessage& next) {
    Bytes& in = next.body;
    in.entity();
    const NumberClaim::Entity writer = in.entity();
    const std::uint64_t start = in.sequence_number();
    const Set set = read_set(in, false);
    if (!in.good()) return Flaw::kLength;
    if (!may_talk(next, writer)) return Flaw::kUnprotected;
    if (start == 0 || set.base > kMaxNumber - kMostBits || set.base < start ||
        set.base - start > kLongestRange || set.bits > kMostBits) {
      return Flaw::kNumber;
    }
    return admit(Kind::kGap, writer, start, set.base + set.bits - 1);
  }

  Flaw acknowledgement(Submessage& next) {
    Bytes& in = next.body;
    in.entity();
    const NumberClaim::Entity writer = in.entity();
    const Set set = read_set(in, false);
    in.u32();
    if (!in.good()) return Flaw::kLength;
    if (!may_talk(next, writer)) return Flaw::kUnprotected;
    if (set.base > kMaxNumber - kMostBits || set.bits > kMostBits) return Flaw::kNumber;
    return admit(Kind::kAcknowledgement, writer, set.base, set.base);
  }

  Flaw missing_fragments(Submessage& next) {
    Bytes& in = next.body;
    in.entity();
    const NumberClaim::Entity writer = in.entity();
    const std::uint64_t number = in.sequence_number();
    const Set set = read_set(in, true);
    in.u32();
    if (!in.good()) return Flaw::kLength;
    if (!may_talk(next, writer)) return Flaw::kUnprotected;
    const bool possible = number > 0 && number <= kMaxNumber && set.bits <= kMostBits;
    return possible ? Flaw::kNone : Flaw::kNumber;
  }

  Flaw fragments_exist(Submessage& next) {
    Bytes& in = next.body;
    in.entity();
    const NumberClaim::Entity writer = in.entity();
    const std::uint64_t number = in.sequence_number();
    in.skip(8);
    if (!in.good()) return Flaw::kLength;
    if (!may_talk(next, writer)) return Flaw::kUnprotected;
    return number > 0 && number <= kMaxNumber ? Flaw::kNone : Flaw::kNumber;
  }

  const bool secured_;
  NumberClaims& claims_;
  NumberClaim::Prefix sender_{};
  bool open_;                        // everything may be said
  bool disposes_ = false;            // the DATA at hand, by its inline QoS
  NumberClaim::Prefix announced_{};  // the participant of the announcement at hand
};

}  // namespace

const char* to_string(DatagramFlaw flaw) {
  switch (flaw) {
    case Flaw::kHeader:
      return "not of RTPS 2";
    case Flaw::kLength:
      return "a part that does not fit into it";
    case Flaw::kNumber:
      return "an impossible number, or a range that is too long";
    case Flaw::kUnprotected:
      return "not protected by keys";
    case Flaw::kJump:
      return "a sequence number far beyond those of its writer";
    case Flaw::kCrowd:
      return "more participants than there is room for";
    case Flaw::kFarewell:
      return "a participant is said to leave";
    default:
      return "";
  }
}

std::vector<std::uint8_t> take_fragments(const std::uint8_t* datagram, std::size_t size,
                                         FragmentTaker& taker) {
  class Claimed final : public NumberClaims {
   public:
    bool admit(const NumberClaim& one) override {
      claim = one;
      return true;
    }
    bool admit_participant(const NumberClaim::Prefix&) override { return true; }
    NumberClaim claim{};
  } claimed;
  return Check(false, claimed).divide(datagram, size, [&](std::vector<std::uint8_t> one) {
    taker.take(claimed.claim, std::move(one));
  });
}

void for_each_heartbeat(const std::uint8_t* datagram, std::size_t size, NumberClaims& claims) {
  Check(false, claims).run_heartbeats(datagram, size);
}

void for_each_acknowledgement(const std::uint8_t* datagram, std::size_t size,
                              NumberClaims& claims) {
  Check(false, claims).run_acknowledgements(datagram, size);
}

DatagramFlaw check_datagram(const std::uint8_t* datagram, std::size_t size, bool secured,
                            NumberClaims& claims) {
  return Check(secured, claims).run(datagram, size);
}

}  // namespace tfdude::fastdds
