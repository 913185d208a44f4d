#include "support/foreign_writer.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/peers.hpp"
#include "transport/fastdds/send_filter.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::testing {
namespace {

namespace edds = fastdds::edds;

edds::DomainParticipantFactory& factory() {
  return *edds::DomainParticipantFactory::get_instance();
}

/// A DDS transport that can be muted.
class MutedDescriptor final : public fastdds::etransport::ChainingTransportDescriptor {
 public:
  MutedDescriptor(std::shared_ptr<fastdds::etransport::TransportDescriptorInterface> real,
                  std::shared_ptr<const std::atomic<bool>> is_muted)
      : ChainingTransportDescriptor(std::move(real)), muted(std::move(is_muted)) {}
  [[nodiscard]] fastdds::etransport::TransportInterface* create_transport() const override;

  std::shared_ptr<const std::atomic<bool>> muted;
};

class MutedTransport final : public fastdds::SendFilter {
 public:
  explicit MutedTransport(const MutedDescriptor& descriptor)
      : SendFilter(descriptor), descriptor_(descriptor) {}
  fastdds::etransport::TransportDescriptorInterface* get_configuration() override {
    return &descriptor_;
  }

 private:
  [[nodiscard]] bool may_send(const fastdds::ertps::Locator_t&) override {
    return !*descriptor_.muted;
  }
  void heard(const fastdds::ertps::Locator_t&) const override {}

  MutedDescriptor descriptor_;
};

fastdds::etransport::TransportInterface* MutedDescriptor::create_transport() const {
  return new MutedTransport(*this);
}

}  // namespace

RawType::RawType(const std::string& name, bool keyed) {
#if TFDUDE_FASTDDS_MAJOR == 2
  setName(name.c_str());
  m_typeSize = 1U << 16U;
  m_isGetKeyDefined = keyed;
#else
  set_name(name);
  max_serialized_type_size = 1U << 16U;
  is_compute_key_provided = keyed;
#endif
}

bool RawType::fill(const Bytes& bytes, fastdds::ertps::SerializedPayload_t& payload) {
  if (bytes.size() > payload.max_size) return false;
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  return true;
}

ForeignWriter::ForeignWriter(std::uint32_t domain, const char* topic_name, edds::TypeSupport type,
                             const std::string& partition, bool durable, const Name& name) {
  edds::DomainParticipantQos participant_qos;
  factory().load_XML_profiles_file(TFDUDE_LOOPBACK_PROFILE);  // loading it twice is harmless
  factory().get_participant_qos_from_profile("tfdude_participant", participant_qos);
  for (auto& transport : participant_qos.transport().user_transports) {
    transport = std::make_shared<MutedDescriptor>(transport, muted_);
  }
  if (!name.name.empty()) participant_qos.name(name.name);
  participant_qos.user_data().data_vec({name.user_data.begin(), name.user_data.end()});
  participant_ = factory().create_participant(domain, participant_qos);
  if (participant_ == nullptr) throw std::runtime_error("no participant for a foreign writer");
  type.register_type(participant_);
  edds::Topic* topic =
      participant_->create_topic(topic_name, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  edds::PublisherQos publisher_qos;
  if (!partition.empty()) publisher_qos.partition().push_back(partition.c_str());
  edds::Publisher* publisher = participant_->create_publisher(publisher_qos);
  edds::DataWriterQos qos;
  qos.data_sharing().off();
  qos.endpoint().history_memory_policy = fastdds::ertps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.writer_resource_limits().reader_filters_allocation.maximum = 0;
  if (durable) qos.durability().kind = edds::TRANSIENT_LOCAL_DURABILITY_QOS;
  writer_ = publisher->create_datawriter(topic, qos);
  if (writer_ == nullptr) throw std::runtime_error("no foreign writer");
}

ForeignWriter::~ForeignWriter() {
  participant_->delete_contained_entities();
  factory().delete_participant(participant_);
}

std::shared_ptr<const Replies> ForeignWriter::read_replies() {
  const edds::TypeSupport type(new fastdds::ReplyType);
  type.register_type(participant_);
  edds::Topic* topic =
      participant_->create_topic(kReplyTopic, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  edds::SubscriberQos subscriber_qos;
  const auto self = fastdds::peer_of(participant_->guid().guidPrefix);
  subscriber_qos.partition().push_back(fastdds::reply_partition("*", self).c_str());
  edds::Subscriber* subscriber = participant_->create_subscriber(subscriber_qos);
  edds::DataReaderQos qos;
  qos.data_sharing().off();
  qos.endpoint().history_memory_policy = fastdds::ertps::DYNAMIC_REUSABLE_MEMORY_MODE;
  if (subscriber->create_datareader(topic, qos, replies_.get()) == nullptr) {
    throw std::runtime_error("no reader of replies");
  }
  return replies_;
}

void Replies::on_data_available(edds::DataReader* reader) {
  wire::Reply sample;
  edds::SampleInfo info;
  while (fastdds::ok(reader->take_next_sample(&sample, &info))) {
    auto reply = fastdds::from_wire(sample);
    if (!info.valid_data || !reply) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = *std::move(reply);
  }
}

std::optional<Reply> Replies::last() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_;
}

void ForeignWriter::await_readers(int count) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  edds::PublicationMatchedStatus status;
  while (writer_->get_publication_matched_status(status), status.current_count < count) {
    if (std::chrono::steady_clock::now() > deadline) {
      throw std::runtime_error("the foreign writer met " + std::to_string(status.current_count) +
                               " of " + std::to_string(count) + " readers");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void ForeignWriter::write(void* sample, std::chrono::nanoseconds ahead) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  fastdds::ertps::Time_t stamp;
  stamp.from_ns(std::chrono::nanoseconds(now + ahead).count());
  fastdds::ertps::WriteParams params;
  params.source_timestamp(stamp);
  if (!fastdds::write(*writer_, sample, params)) {
    throw std::runtime_error("a foreign write failed");
  }
}

}  // namespace tfdude::testing
