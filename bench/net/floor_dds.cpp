#include "net/floor_dds.hpp"

#include <chrono>
#include <thread>

#include "net/harness.hpp"

namespace bench {

namespace edds = fastdds::edds;

FloorEndpoints::FloorEndpoints(std::uint32_t domain, const std::string& profile, const char* to,
                               const char* from, edds::DataReaderListener& listener,
                               const std::string& kind) {
  const auto profiles = must(fastdds::Profiles::load(profile), "the profile");
  const edds::TypeSupport type(new PingType);
  participant_ = edds::DomainParticipantFactory::get_instance()->create_participant(
      domain, profiles.participant());
  type.register_type(participant_);
  auto* to_topic = participant_->create_topic(to, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  auto* from_topic =
      participant_->create_topic(from, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  auto* publisher = participant_->create_publisher(edds::PUBLISHER_QOS_DEFAULT);
  auto* subscriber = participant_->create_subscriber(edds::SUBSCRIBER_QOS_DEFAULT);
  writer_ = publisher->create_datawriter(to_topic, profiles.writer(*publisher, kind + "_writer"));
  reader_ = subscriber->create_datareader(
      from_topic, profiles.reader(*subscriber, kind + "_reader"), &listener);
}

FloorEndpoints::~FloorEndpoints() {
  participant_->delete_contained_entities();
  edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

bool FloorEndpoints::matched() const {
  edds::PublicationMatchedStatus readers;
  edds::SubscriptionMatchedStatus writers;
  writer_->get_publication_matched_status(readers);
  reader_->get_subscription_matched_status(writers);
  return readers.current_count > 0 && writers.current_count > 0;
}

void await_match(const FloorEndpoints& endpoints) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (!endpoints.matched()) {
    if (Clock::now() > deadline) give_up("no other end of the bare DDS was discovered");
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

}  // namespace bench
