#include "net/floor_dds.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "net/harness.hpp"

namespace bench {

namespace edds = fastdds::edds;
using tfdude::Reply;
using tfdude::Request;

Sizes sizes_of(const Request& request, const std::string& partition, const Reply& reply) {
  return {payload_size<tfdude::wire::RequestPubSubType>(fastdds::to_wire(request, partition)),
          payload_size<tfdude::wire::ReplyPubSubType>(fastdds::to_wire(reply))};
}

FloorEndpoints::FloorEndpoints(std::uint32_t domain, const std::string& profile,
                               const FloorEnds& ends, edds::DataReaderListener& listener) {
  const auto profiles = must(fastdds::Profiles::load(profile), "the profile");
  const std::string kind = ends.kind;
  const edds::TypeSupport type(new PingType);
  participant_ = edds::DomainParticipantFactory::get_instance()->create_participant(
      domain, profiles.participant());
  type.register_type(participant_);
  auto* to = participant_->create_topic(ends.to, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  auto* from = participant_->create_topic(ends.from, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  for (const std::string& partition : ends.written) {
    edds::PublisherQos qos;
    if (!partition.empty()) qos.partition().push_back(partition.c_str());
    auto* publisher = participant_->create_publisher(qos);
    writers_.push_back(
        publisher->create_datawriter(to, profiles.writer(*publisher, kind + "_writer")));
  }
  edds::SubscriberQos qos;
  if (!ends.read.empty()) qos.partition().push_back(ends.read.c_str());
  auto* subscriber = participant_->create_subscriber(qos);
  reader_ = subscriber->create_datareader(from, profiles.reader(*subscriber, kind + "_reader"),
                                          &listener);
}

FloorEndpoints::~FloorEndpoints() {
  participant_->delete_contained_entities();
  edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

bool FloorEndpoints::matched() const {
  edds::SubscriptionMatchedStatus found;
  reader_->get_subscription_matched_status(found);
  return found.current_count >= static_cast<std::int32_t>(writers_.size()) &&
         std::all_of(writers_.begin(), writers_.end(), [](edds::DataWriter* writer) {
           edds::PublicationMatchedStatus readers;
           writer->get_publication_matched_status(readers);
           return readers.current_count > 0;
         });
}

void await_match(const FloorEndpoints& endpoints) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (!endpoints.matched()) {
    if (Clock::now() > deadline) give_up("no other end of the bare DDS was discovered");
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

DdsPing::DdsPing(std::uint32_t domain, const std::string& profile, const FloorEnds& ends)
    : awaits_(ends.written.size()), endpoints_(domain, profile, ends, *this) {
  await_match(endpoints_);
}

void DdsPing::prepare(const Sizes& sizes) {
  ping_.filler().resize(sizes.request - kPingOverhead);
  ping_.reply_bytes(sizes.reply);
}

void DdsPing::call() {
  {
    const std::lock_guard lock(mutex_);
    first_ += static_cast<std::uint32_t>(awaits_.size());
    std::fill(awaits_.begin(), awaits_.end(), 1);
    missing_ = awaits_.size();
  }
  ask_all();
  std::unique_lock lock(mutex_);
  // Repeats the requests, as tf-dude does.
  while (!arrived_.wait_for(lock, std::chrono::milliseconds(2), [this] { return missing_ == 0; })) {
    lock.unlock();
    ask_all();
    lock.lock();
  }
}

void DdsPing::ask_all() {
  for (std::size_t i = 0; i < awaits_.size(); ++i) {
    ping_.sequence_number(first_ + static_cast<std::uint32_t>(i));
    endpoints_.write(ping_, i);
  }
}

void DdsPing::on_data_available(edds::DataReader* reader) {
  while (fastdds::ok(reader->take_next_sample(&pong_, &info_))) {
    if (!info_.valid_data) continue;
    const std::uint32_t echo = pong_.sequence_number() - first_;
    const std::lock_guard lock(mutex_);
    if (echo >= awaits_.size() || std::exchange(awaits_[echo], 0) == 0 || --missing_ > 0) continue;
    arrived_.notify_one();
  }
}

}  // namespace bench
