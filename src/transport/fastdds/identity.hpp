#pragma once

#include "transport/fastdds/compat.hpp"

// The identity of a participant.
namespace tfdude::fastdds {

/// Gives a participant an identity as if it were alone in its process. Between participants of one
/// process, Fast DDS delivers inside the writer's call. It then holds locks that a callback which
/// writes needs, too, so two participants that ask each other deadlock. A setting of the whole
/// process controls this, which a library must not change. But Fast DDS recognizes one process by
/// bytes 4 to 7 of the GUID prefixes, so these are made unique.
void be_a_process_of_its_own(edds::DomainParticipantQos& qos);

/// Gives a writer its own persistence GUID. Otherwise writers of participants with a chosen
/// identity share one, and a reader that has met one writer takes the first DDS samples of the next
/// one for old ones.
void be_a_writer_of_its_own(edds::DataWriterQos& qos);

}  // namespace tfdude::fastdds
