#pragma once

#include <functional>
#include <memory>

#include "../ros_domain.hpp"
#include "transport/fastdds/compat.hpp"

// What a topic's type determines: its registration, and the conversion of its messages.
namespace tfdude::ros {

[[nodiscard]] fastdds::edds::TypeSupport type_support(MessageType type);

/// As Bridges::find().
using FindBridge = std::function<std::optional<BridgeMark>(const fastdds::ertps::GuidPrefix_t&)>;

/// A listener that takes the samples of a reader, and passes them on as plain messages.
[[nodiscard]] std::unique_ptr<fastdds::edds::DataReaderListener> reading(MessageType type,
                                                                         Take take,
                                                                         FindBridge find_bridge);

/// @param type  not one of those of detections
/// @param writer  of the publisher; deleted with the result
[[nodiscard]] std::unique_ptr<Publisher> writing(MessageType type,
                                                 fastdds::edds::Publisher& publisher,
                                                 fastdds::edds::DataWriter& writer);

[[nodiscard]] fastdds::edds::DataReaderQos reader_qos(const Topic& topic);
[[nodiscard]] fastdds::edds::DataWriterQos writer_qos(const Topic& topic);

}  // namespace tfdude::ros
