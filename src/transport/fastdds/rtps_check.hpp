#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

// What a datagram must be before Fast DDS may have it. Fast DDS (2.9 and 3.1) believes numbers and
// lengths that a stranger may choose: it walks through all numbers of a GAP, and of those that a
// HEARTBEAT skips (CVE-2025-64438); it allocates what the lengths of a handshake say
// (CVE-2025-62599, -62600, -62602, -62603); and it copies as many bytes of the last fragment as the
// sample should have.
namespace tfdude::fastdds {

/// Why a datagram is dropped.
enum class DatagramFlaw : std::uint8_t {
  kNone,
  kHeader,       ///< it is not of RTPS 2
  kLength,       ///< a submessage, or a part of it, does not fit into what contains it
  kNumber,       ///< a number that RTPS does not allow, or a range that is too long
  kUnprotected,  ///< only participants with keys may say this, and it is not protected
  kJump,         ///< a sequence number further ahead than its writer can be
  kCrowd,        ///< it announces one participant more than there is room for
  kFarewell,     ///< it says of a participant with keys that this leaves, which may be a lie
  kFlawCount
};

[[nodiscard]] const char* to_string(DatagramFlaw flaw);

/// Sequence numbers of one writer that a submessage names. The writer is one of the sender's,
/// except in an acknowledgement.
struct NumberClaim {
  enum class Kind : std::uint8_t { kData, kFragments, kHeartbeat, kGap, kAcknowledgement };
  using Prefix = std::array<std::uint8_t, 12>;
  using Entity = std::array<std::uint8_t, 4>;

  Kind kind;
  Prefix sender;
  Entity writer;
  /// kHeartbeat: the first that exists. kGap: the first that is left out. kAcknowledgement: the
  /// first that is missing. Otherwise the sample's.
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint32_t count = 0;         ///< of the heartbeat
  std::uint32_t sample_bytes = 0;  ///< of the sample whose fragments these are
  std::uint16_t fragment_bytes = 0;
  std::uint32_t fragment = 0;  ///< the first of them, from 1
  std::uint32_t many = 0;
};

class NumberClaims {
 public:
  /// Whether the claim may be true.
  [[nodiscard]] virtual bool admit(const NumberClaim& claim) = 0;
  /// Whether there is room for a participant, by the prefix of its GUIDs.
  [[nodiscard]] virtual bool admit_participant(const NumberClaim::Prefix& participant) = 0;

 protected:
  ~NumberClaims() = default;
};

/// The most numbers from the first to the last one in a GAP or a HEARTBEAT: more than any history
/// of ours has (Pages::kRepeatWithin, and the depths in the profiles).
inline constexpr std::uint64_t kLongestRange = 65'536;
/// No message of ours is larger.
inline constexpr std::uint32_t kLargestSample = 16U << 20U;
/// Fast DDS writes a number at the begin of each fragment. Those of any DDS are larger.
inline constexpr std::uint16_t kSmallestFragment = 64;
/// [s] With keys, an announcement may not say that its participant is lost earlier.
inline constexpr std::int32_t kShortestLease = 5;

/// Checks a datagram as far as it can be read: its header, the length and the numbers of each
/// submessage, and what discovery and handshake contain. Encrypted parts cannot be read.
/// @param secured  the participant has keys. Then only announcements and handshakes may come
///   unprotected (DDS Security 1.1, 8.4.2.4); Fast DDS 2.9 does not insist on that.
/// @param claims  is asked about each claim, in order, until one is not admitted
/// @par Complexity  O(size); does not allocate
[[nodiscard]] DatagramFlaw check_datagram(const std::uint8_t* datagram, std::size_t size,
                                          bool secured, NumberClaims& claims);

/// Takes fragments out of a datagram.
class FragmentTaker {
 public:
  /// @param datagram  in which these fragments are all that is of a writer
  virtual void take(const NumberClaim& claim, std::vector<std::uint8_t> datagram) = 0;

 protected:
  ~FragmentTaker() = default;
};

/// Divides a datagram that was checked, and that has fragments: each DATA_FRAG into one of its own.
/// @return the rest; empty: there is nothing else
[[nodiscard]] std::vector<std::uint8_t> take_fragments(const std::uint8_t* datagram,
                                                       std::size_t size, FragmentTaker& taker);

/// Passes on what the heartbeats of an own datagram claim. Its sender counts for nothing.
void for_each_heartbeat(const std::uint8_t* datagram, std::size_t size, NumberClaims& claims);

/// Passes on what an own datagram acknowledges. The sender in a claim is the participant of the
/// writer, to whom it is sent.
void for_each_acknowledgement(const std::uint8_t* datagram, std::size_t size, NumberClaims& claims);

}  // namespace tfdude::fastdds
