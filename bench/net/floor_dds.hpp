#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "transport/fastdds/codec.hpp"
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

/// CDR payloads of one kind of call.
struct Sizes {
  std::uint32_t request;
  std::uint32_t reply;
};

/// As our codec serializes them.
Sizes sizes_of(const tfdude::Request& request, const std::string& partition,
               const tfdude::Reply& reply);

/// What the endpoints of a participant are for.
struct FloorEnds {
  const char* to;                        ///< topic
  const char* from;                      ///< topic
  const char* kind;                      ///< the start of the names of both profiles
  std::vector<std::string> written{""};  ///< DDS partitions; there is a writer for each
  std::string read = {};                 ///< DDS partition; empty: the default one
};

/// The ends of a stream.
inline FloorEnds sending_end() { return {kPingTopic, kPongTopic, "update"}; }
inline FloorEnds listening_end() { return {kPongTopic, kPingTopic, "update"}; }
/// The ends of a round trip.
inline FloorEnds asking_end() { return {kPingTopic, kPongTopic, "call"}; }
inline FloorEnds answering_end() { return {kPongTopic, kPingTopic, "call"}; }

/// A participant with writers and one reader. Nothing is checked for null: if the library cannot
/// create an entity, a signal ends the process, and its log says why.
class FloorEndpoints {
 public:
  /// @param profile  as for our participants: a file
  FloorEndpoints(std::uint32_t domain, const std::string& profile, const FloorEnds& ends,
                 fastdds::edds::DataReaderListener& listener);
  ~FloorEndpoints();
  FloorEndpoints(const FloorEndpoints&) = delete;
  FloorEndpoints& operator=(const FloorEndpoints&) = delete;

  bool write(wire::Ping& ping, std::size_t writer = 0) {
    return fastdds::write(*writers_[writer], &ping);
  }
  /// Whether each writer has found a reader, and the reader as many writers.
  [[nodiscard]] bool matched() const;

 private:
  fastdds::edds::DomainParticipant* participant_;
  std::vector<fastdds::edds::DataWriter*> writers_;
  fastdds::edds::DataReader* reader_;
};

/// Writes to one or several echoes at once, and waits for the listener of the replies' reader, as
/// tf-dude's client does.
class DdsPing final : public fastdds::edds::DataReaderListener {
 public:
  DdsPing(std::uint32_t domain, const std::string& profile, const FloorEnds& ends = asking_end());

  void prepare(const Sizes& sizes);
  void call();

  void on_data_available(fastdds::edds::DataReader* reader) override;

 private:
  void ask_all();

  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<char> awaits_;  // from which echoes
  std::size_t missing_ = 0;   // how many of them
  std::uint32_t first_ = 0;   // number of the ping to the first echo
  wire::Ping ping_;
  wire::Ping pong_;
  fastdds::edds::SampleInfo info_;
  FloorEndpoints endpoints_;
};

/// Ends the program if nobody is discovered.
void await_match(const FloorEndpoints& endpoints);

}  // namespace bench
