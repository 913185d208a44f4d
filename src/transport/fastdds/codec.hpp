#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "tfdude/base/result.hpp"

#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

// Converts between the messages of the partition layer and those on the network. Received messages
// are checked field by field: an error names the frame and the field.
namespace tfdude::fastdds {

/// What is sent instead of an absent stamp.
inline constexpr std::int64_t kNoStamp = -1;
/// What is pushed instead of the stamp of a value if the history was cleared.
inline constexpr std::int64_t kClearedStamp = -2;

[[nodiscard]] inline std::int64_t wire_stamp(std::optional<Time> stamp) {
  return stamp ? nanoseconds(*stamp) : kNoStamp;
}

/// @param field  the name for an error
/// @return kInvalidInput if the stamp is negative, but not kNoStamp
[[nodiscard]] Result<std::optional<Time>> stamp_from_wire(std::int64_t stamp, const char* field);

/// Fills a DDS sample that may have been used before: the generated union has a member for every
/// kind of request, some 1.5 KB, which takes longer to create than to fill.
void write_wire(const Request& request, std::string_view partition, wire::Request& sample);
/// Likewise, without allocating where the sample has held as many edges or joints of names as long.
void write_wire(const Update& update, wire::Update& sample);
void write_wire(const JointUpdate& update, wire::Joints& sample);
void write_wire(const Reply& reply, wire::Reply& sample);
void write_wire(const PushedValues& pushed, wire::State& sample);
[[nodiscard]] wire::Request to_wire(const Request& request, std::string_view partition);
[[nodiscard]] wire::Reply to_wire(const Reply& reply);
[[nodiscard]] wire::Update to_wire(const Update& update);
[[nodiscard]] wire::Joints to_wire(const JointUpdate& update);
[[nodiscard]] wire::State to_wire(const PushedValues& pushed);
[[nodiscard]] wire::Clock to_wire(Time now);
[[nodiscard]] wire::Page to_wire(const Page& page);
[[nodiscard]] wire::Presence to_wire(const Presence& presence);

[[nodiscard]] Result<Request> from_wire(const wire::Request& sample);
[[nodiscard]] Result<Reply> from_wire(const wire::Reply& sample);
/// Only those edges that the predicate accepts by their id; the others are not even checked.
[[nodiscard]] Result<Update> from_wire(const wire::Update& sample,
                                       const std::function<bool(std::string_view)>& accept);
/// Likewise, by the name of the joint.
[[nodiscard]] Result<JointUpdate> from_wire(const wire::Joints& sample,
                                            const std::function<bool(std::string_view)>& accept);
[[nodiscard]] Result<PushedValues> from_wire(const wire::State& sample);
[[nodiscard]] Result<Time> from_wire(const wire::Clock& sample);
[[nodiscard]] Result<Page> from_wire(const wire::Page& sample);
[[nodiscard]] Result<Presence> from_wire(const wire::Presence& sample);

}  // namespace tfdude::fastdds
