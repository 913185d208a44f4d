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

// Bare Fast DDS, with QoS from the same profiles that our transport uses.
namespace bench {

namespace fastdds = tfdude::fastdds;

inline constexpr const char* kPingTopic = "floor/ping";
inline constexpr const char* kPongTopic = "floor/pong";

/// The bytes of a ping's CDR payload besides the filler: the encapsulation and three numbers.
inline constexpr std::uint32_t kPingOverhead = 16;

inline bool any_payload(const std::uint8_t*, std::size_t) { return true; }
/// Preallocates memory, as our types do.
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

/// A participant with one writer and one reader. Nothing is checked for null: if the library cannot
/// create an entity, a signal ends the process, and its log says why.
class FloorEndpoints {
 public:
  /// @param profile  as for our participants: a file
  /// @param kind  the start of the names of both profiles: "call", "update"
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

/// Ends the program if nobody is discovered.
void await_match(const FloorEndpoints& endpoints);

}  // namespace bench
