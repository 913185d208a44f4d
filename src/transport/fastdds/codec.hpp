#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "tfdude/base/result.hpp"

#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

// Converts between the messages of the partition layer and those on the network, by one description
// of each (fields.hpp). Received messages are checked field by field: an error names the frame and
// the field.
namespace tfdude::fastdds {

/// A sign of life that a request asks for, and that a reply gives: numbers of their unions.
inline constexpr std::uint8_t kProbe = 17;
inline constexpr std::uint8_t kAlive = 10;

// ---- bytes

// Whether the bytes of a DDS sample can be deserialized: every length is within the bytes present
// and within the bounds of idl/tfdude.idl.
[[nodiscard]] bool well_formed_request(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_reply(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_update(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_joints(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_state(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_clock(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_page(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_presence(const std::uint8_t* data, std::size_t size);

/// What a filter must know of a request; the id points into the sample. It comes before the body,
/// so that also requests of later versions can be answered.
struct RequestHead {
  std::string_view id;
  std::uint32_t addressee = 0;
};

/// Nothing if the request is not well formed so far.
[[nodiscard]] std::optional<RequestHead> read_request_head(const std::uint8_t* data,
                                                           std::size_t size);

using Accept = std::function<bool(std::string_view)>;

/// Whether a predicate accepts an edge of an update, by its id. The bytes are read until it does;
/// nothing if the update is not well formed so far.
[[nodiscard]] std::optional<bool> any_edge(const std::uint8_t* data, std::size_t size,
                                           const Accept& accept);
/// The same with the name of each joint of a sample of joints.
[[nodiscard]] std::optional<bool> any_joint(const std::uint8_t* data, std::size_t size,
                                            const Accept& accept);

/// FNV-1a, 32 bits: how a request names the partition that it is addressed to.
[[nodiscard]] constexpr std::uint32_t addressee_of(std::string_view partition) {
  std::uint32_t hash = 2166136261U;
  for (const char c : partition) hash = (hash ^ static_cast<std::uint8_t>(c)) * 16777619U;
  return hash;
}

// ---- to the network

/// Fills a DDS sample that may have been used before, without allocating where it has held as many
/// elements of names as long. The generated union has a member for every kind of request, some 1.5
/// KB, which takes longer to create than to fill.
void write_wire(const Request& request, std::string_view partition, wire::Request& sample);
void write_wire(const Reply& reply, wire::Reply& sample);
void write_wire(const Update& update, wire::Update& sample);
void write_wire(const JointUpdate& update, wire::Joints& sample);
void write_wire(const PushedValues& pushed, wire::State& sample);
void write_wire(const Page& page, wire::Page& sample);
void write_wire(const Presence& presence, wire::Presence& sample);

template <class Sample, class... Message>
[[nodiscard]] Sample written(const Message&... message) {
  Sample sample;
  write_wire(message..., sample);
  return sample;
}

[[nodiscard]] inline wire::Request to_wire(const Request& request, std::string_view partition) {
  return written<wire::Request>(request, partition);
}
[[nodiscard]] inline wire::Reply to_wire(const Reply& reply) { return written<wire::Reply>(reply); }
[[nodiscard]] inline wire::Update to_wire(const Update& update) {
  return written<wire::Update>(update);
}
[[nodiscard]] inline wire::Joints to_wire(const JointUpdate& update) {
  return written<wire::Joints>(update);
}
[[nodiscard]] inline wire::State to_wire(const PushedValues& pushed) {
  return written<wire::State>(pushed);
}
[[nodiscard]] inline wire::Page to_wire(const Page& page) { return written<wire::Page>(page); }
[[nodiscard]] inline wire::Presence to_wire(const Presence& presence) {
  return written<wire::Presence>(presence);
}
[[nodiscard]] wire::Clock to_wire(Time now);

// ---- from the network

[[nodiscard]] Result<Request> from_wire(const wire::Request& sample);
[[nodiscard]] Result<Reply> from_wire(const wire::Reply& sample);
/// Only those edges that the predicate accepts by their id; the others are not even checked.
[[nodiscard]] Result<Update> from_wire(const wire::Update& sample, const Accept& accept);
/// Likewise, by the name of the joint.
[[nodiscard]] Result<JointUpdate> from_wire(const wire::Joints& sample, const Accept& accept);
[[nodiscard]] Result<PushedValues> from_wire(const wire::State& sample);
[[nodiscard]] Result<Time> from_wire(const wire::Clock& sample);
[[nodiscard]] Result<Page> from_wire(const wire::Page& sample);
[[nodiscard]] Result<Presence> from_wire(const wire::Presence& sample);

}  // namespace tfdude::fastdds
