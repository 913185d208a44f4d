#pragma once

#include <cstdint>
#include <string>

#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/profiles.hpp"

#if TFDUDE_FASTDDS_MAJOR == 2
#include <floorPubSubTypes.h>
#else
#include <floorPubSubTypes.hpp>
#endif

// Bare Fast DDS, with QoS from the very profiles that our transport takes for its own.
namespace bench {

namespace fastdds = tfdude::fastdds;

inline constexpr const char* kPingTopic = "floor/ping";
inline constexpr const char* kPongTopic = "floor/pong";

/// What a ping's CDR payload has besides the filler: the encapsulation and three numbers.
inline constexpr std::uint32_t kPingOverhead = 16;

inline bool any_payload(const std::uint8_t*, std::size_t) { return true; }
/// Preallocates as our types do.
using PingType = fastdds::CheckedType<wire::PingPubSubType, any_payload>;

/// Bytes of a sample's CDR payload.
template <class PubSubType, class Sample>
std::uint32_t payload_size(Sample sample) {
  PubSubType type;
#if TFDUDE_FASTDDS_MAJOR == 2
  return type.getSerializedSizeProvider(&sample)();
#else
  return type.calculate_serialized_size(&sample, fastdds::edds::DEFAULT_DATA_REPRESENTATION);
#endif
}

/// A participant with one writer and one reader. Nothing is checked for null: the process ends by a
/// signal where the library cannot make something, and its log says why.
class FloorEndpoints {
 public:
  /// @param profile  as for our participants: a file
  /// @param kind  what the names of the profiles of both begin with: "call", "update"
  FloorEndpoints(std::uint32_t domain, const std::string& profile, const char* to, const char* from,
                 fastdds::edds::DataReaderListener& listener, const std::string& kind);
  ~FloorEndpoints();
  FloorEndpoints(const FloorEndpoints&) = delete;
  FloorEndpoints& operator=(const FloorEndpoints&) = delete;

  bool write(wire::Ping& ping) { return fastdds::write(*writer_, &ping); }
  [[nodiscard]] bool matched() const;

 private:
  fastdds::edds::DomainParticipant* participant_;
  fastdds::edds::DataWriter* writer_;
  fastdds::edds::DataReader* reader_;
};

/// Gives up where nobody is met.
void await_match(const FloorEndpoints& endpoints);

}  // namespace bench
