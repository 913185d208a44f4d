#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "tfdude-ros/fastdds/endpoints.hpp"
#include "transport/fastdds/compat.hpp"

// The bytes of ROS's messages, as DDS writers and readers of the bridge make and read them.
namespace tfdude::ros {

using Payload = fastdds::ertps::SerializedPayload_t;

#if TFDUDE_FASTDDS_MAJOR == 2
template <class Generated>
bool serialize(fastdds::edds::TopicDataType& type, Generated& message, Payload& payload) {
  return type.serialize(&message, &payload);
}
template <class Generated>
bool deserialize(fastdds::edds::TopicDataType& type, Payload& payload, Generated& message) {
  return type.deserialize(&payload, &message);
}
#else
template <class Generated>
bool serialize(fastdds::edds::TopicDataType& type, Generated& message, Payload& payload) {
  return type.serialize(&message, payload, fastdds::edds::DEFAULT_DATA_REPRESENTATION);
}
template <class Generated>
bool deserialize(fastdds::edds::TopicDataType& type, Payload& payload, Generated& message) {
  return type.deserialize(payload, &message);
}
#endif

/// Empty if Fast DDS does not serialize it, or if it has more than 64 KiB.
template <class Generated>
[[nodiscard]] std::vector<std::uint8_t> bytes_of(MessageType type, Generated message) {
  Payload payload(1U << 16U);
  if (!serialize(*type_support(type), message, payload)) return {};
  return {payload.data, payload.data + payload.length};
}

/// As a reader of this type reads them. @return false if it rejects them
template <class Generated>
[[nodiscard]] bool read(MessageType type, const std::vector<std::uint8_t>& bytes,
                        Generated& message) {
  Payload payload(static_cast<std::uint32_t>(bytes.size() + 1));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  return deserialize(*type_support(type), payload, message);
}

}  // namespace tfdude::ros
