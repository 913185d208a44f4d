#pragma once

#include "transport/fastdds/compat.hpp"

// Who a participant is to the others.
namespace tfdude::fastdds {

/// Gives a participant an identity as if it were alone in its process. Fast DDS delivers between participants of one process
/// inside the writer's call, with locks held that a callback which writes needs, too: two who ask each other then wait for
/// each other. Whether it does so is a setting of the whole process, which is not a library's to change; but what it
/// takes for one process is told by the identities: bytes 4 to 7 of their GUID prefix.
void be_a_process_of_its_own(edds::DomainParticipantQos& qos);

/// Gives a writer a persistence GUID of its own. Writers of participants whose identity was chosen share one else, and a
/// reader that has met one of them takes the next one's first samples for old ones.
void be_a_writer_of_its_own(edds::DataWriterQos& qos);

}  // namespace tfdude::fastdds
