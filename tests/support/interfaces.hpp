#pragma once

namespace tfdude::testing {

/// Makes Fast DDS read the network interfaces again, as the calling thread sees them now. Fast DDS
/// 3.1 reads them once for the whole process, and again only when a participant's QoS is set; 2.9
/// reads them for each participant.
void read_interfaces();

}  // namespace tfdude::testing
