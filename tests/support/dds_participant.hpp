#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "tfdude/keys/key_files.hpp"

#include "support/process.hpp"
#include "transport/fastdds/access.hpp"
#include "transport/fastdds/discovery_gate.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::testing {

namespace edds = fastdds::edds;

/// A participant of Fast DDS on this computer that is none of tf-dude: with keys it may try what
/// Fast DDS allows with them.
class DdsParticipant {
 public:
  /// @param keys  null: no security
  explicit DdsParticipant(std::uint32_t domain, const KeyFiles* keys = nullptr) {
    edds::DomainParticipantQos qos;
    factory().load_XML_profiles_file(TFDUDE_LOOPBACK_PROFILE);  // loading it twice is harmless
    factory().get_participant_qos_from_profile("tfdude_participant", qos);
    // The handshake takes longer than the lease of the profile.
    qos.wire_protocol().builtin.discovery_config.leaseDuration = {30, 0};
    if (keys != nullptr) fastdds::Access(*keys).secure(qos);
    // Otherwise an assertion of Fast DDS may end the process (send_filter.hpp).
    fastdds::DiscoveryGate gate(std::make_shared<fastdds::Gate>(),
                                std::make_shared<fastdds::LifeSigns>());
    gate.prepare(qos, domain, false);
    participant_ = factory().create_participant(domain, qos);
    gate.open();
  }
  ~DdsParticipant() {
    if (participant_ == nullptr) return;
    participant_->delete_contained_entities();
    factory().delete_participant(participant_);
  }
  DdsParticipant(const DdsParticipant&) = delete;
  DdsParticipant& operator=(const DdsParticipant&) = delete;

  [[nodiscard]] bool good() const { return participant_ != nullptr; }

  /// @return null if it is not allowed
  template <class Type = fastdds::PresenceType>
  [[nodiscard]] edds::DataWriter* write(const char* topic, const char* partition,
                                        const edds::DataWriterQos& qos = {}) {
    edds::PublisherQos publisher;
    publisher.partition().push_back(partition);
    return participant_->create_publisher(publisher)->create_datawriter(topic_of<Type>(topic), qos);
  }
  template <class Type = fastdds::PresenceType>
  [[nodiscard]] edds::DataReader* read(const char* topic, const char* partition) {
    edds::SubscriberQos qos;
    qos.partition().push_back(partition);
    return participant_->create_subscriber(qos)->create_datareader(topic_of<Type>(topic),
                                                                   edds::DATAREADER_QOS_DEFAULT);
  }

  /// A durable writer, as those of presence and structure.
  template <class Type>
  [[nodiscard]] edds::DataWriter* write_durable(const char* topic, const char* partition) {
    edds::DataWriterQos qos;
    qos.durability().kind = edds::TRANSIENT_LOCAL_DURABILITY_QOS;
    qos.data_sharing().off();
    qos.endpoint().history_memory_policy = fastdds::ertps::DYNAMIC_REUSABLE_MEMORY_MODE;
    return write<Type>(topic, partition, qos);
  }

 private:
  static edds::DomainParticipantFactory& factory() {
    return *edds::DomainParticipantFactory::get_instance();
  }

  template <class Type>
  edds::Topic* topic_of(const char* name) {
    auto* known = participant_->lookup_topicdescription(name);
    if (known != nullptr) return dynamic_cast<edds::Topic*>(known);
    const edds::TypeSupport type(new Type);
    type.register_type(participant_);
    return participant_->create_topic(name, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  }

  edds::DomainParticipant* participant_ = nullptr;
};

[[nodiscard]] inline int readers_of(edds::DataWriter* writer) {
  edds::PublicationMatchedStatus status;
  writer->get_publication_matched_status(status);
  return status.current_count;
}

[[nodiscard]] inline int writers_of(edds::DataReader* reader) {
  edds::SubscriptionMatchedStatus status;
  reader->get_subscription_matched_status(status);
  return status.current_count;
}

}  // namespace tfdude::testing
