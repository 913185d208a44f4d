#pragma once

#include <string>

#include "tfdude/base/result.hpp"

#include "transport/fastdds/compat.hpp"

// QoS by the names of profiles/tfdude.xml, without their prefix: "participant", "call_writer"...
namespace tfdude::fastdds {

/// Makes the built-in profiles known, and those of a user's file, which then take their place.
/// @param file  empty: none
/// @return kConfig naming the file.
[[nodiscard]] Result<void> load_profiles(const std::string& file);

[[nodiscard]] edds::DomainParticipantQos participant_qos();
[[nodiscard]] edds::DataWriterQos writer_qos(edds::Publisher& publisher, const std::string& name);
[[nodiscard]] edds::DataReaderQos reader_qos(edds::Subscriber& subscriber, const std::string& name);

}  // namespace tfdude::fastdds
