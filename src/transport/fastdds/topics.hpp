#pragma once

#include <memory>

#include "tfdude/transport/fastdds.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/compat.hpp"
#include "types/topic_names.hpp"

// The types of the topics, and the handling of rejected DDS samples.
namespace tfdude::fastdds {

using RequestType = CheckedType<wire::RequestPubSubType, well_formed_request>;
using ReplyType = CheckedType<wire::ReplyPubSubType, well_formed_reply>;
using UpdateType = CheckedType<wire::UpdatePubSubType, well_formed_update>;
using JointsType = CheckedType<wire::JointsPubSubType, well_formed_joints>;
using StateType = CheckedType<wire::StatePubSubType, well_formed_state>;
using ClockType = CheckedType<wire::ClockPubSubType, well_formed_clock>;
using PageType = CheckedType<wire::PagePubSubType, well_formed_page>;
using PresenceType = CheckedType<wire::PresencePubSubType, well_formed_presence>;

/// The topics of a participant.
struct Topics {
  edds::Topic* request = nullptr;
  edds::Topic* change = nullptr;
  edds::Topic* reply = nullptr;
  edds::Topic* update = nullptr;
  edds::Topic* joint = nullptr;
  edds::Topic* state = nullptr;
  edds::Topic* clock = nullptr;
  edds::Topic* directory = nullptr;
  edds::Topic* presence = nullptr;
};

/// Registers their types, which count what is malformed, and creates them.
/// @return kTransport, naming one that could not be created
[[nodiscard]] Result<void> create_topics(edds::DomainParticipant& participant,
                                         const std::shared_ptr<FastDdsCounters>& counters,
                                         Topics& topics);

/// Counts a sample that was dropped as not well formed, and logs the 1st, 2nd, 4th, 8th...
void count_malformed(FastDdsCounters& counters, const char* topic);

/// Logs why the content of a well-formed sample was rejected.
void log_refused(const char* topic, const Error& error);

}  // namespace tfdude::fastdds
