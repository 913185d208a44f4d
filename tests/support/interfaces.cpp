#include "support/interfaces.hpp"

#include <stdexcept>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>

namespace tfdude::testing {

void read_interfaces() {
  namespace edds = eprosima::fastdds::dds;
  constexpr edds::DomainId_t kUnused = 232;
  auto* factory = edds::DomainParticipantFactory::get_instance();
  auto* participant = factory->create_participant(kUnused, edds::PARTICIPANT_QOS_DEFAULT);
  if (participant == nullptr) throw std::runtime_error("no participant to read interfaces by");
  (void)participant->set_qos(participant->get_qos());
  (void)factory->delete_participant(participant);
}

}  // namespace tfdude::testing
