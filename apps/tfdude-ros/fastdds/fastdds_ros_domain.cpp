#include "fastdds_ros_domain.hpp"

#include <utility>

#include "endpoints.hpp"
#include "guarded_udp.hpp"
#include "identity.hpp"
#include "well_formed.hpp"

namespace tfdude::ros {
namespace {

namespace edds = fastdds::edds;

edds::DomainParticipantFactory& factory() {
  return *edds::DomainParticipantFactory::get_instance();
}

// UDP only: the shared memory of one version of Fast DDS is not that of another.
void set_network(Range range, edds::DomainParticipantQos& qos) {
  constexpr std::uint32_t kSocketBuffer = 4U << 20U;
  auto udp = std::make_shared<fastdds::etransport::UDPv4TransportDescriptor>();
  udp->receiveBufferSize = kSocketBuffer;
  if (range == Range::kThisComputer) {
    // Nodes that were told LOCALHOST discover by unicast; they also send their announcements here.
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
  }
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(guarded(std::move(udp)));
}

tl::unexpected<Error> not_created(const std::string& what) {
  return fail(Errc::kTransport, "Fast DDS could not create " + what);
}

// ROS puts a prefix before the names of topics.
std::string dds_name(const Topic& topic) { return "rt" + topic.name; }

}  // namespace

void Bridges::met(const Prefix& prefix, const std::string& /*name*/,
                  const std::vector<std::uint8_t>& data) {
  auto mark = mark_of(data);
  if (!mark) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  present_[prefix] = *std::move(mark);
}

void Bridges::left(const Prefix& prefix) {
  const std::lock_guard<std::mutex> lock(mutex_);
  present_.erase(prefix);
}

std::optional<BridgeMark> Bridges::find(const Prefix& prefix) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = present_.find(prefix);
  if (found == present_.end()) return std::nullopt;
  return found->second;
}

std::vector<BridgeMark> Bridges::present() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<BridgeMark> marks;
  for (const auto& [prefix, mark] : present_) marks.push_back(mark);
  return marks;
}

Result<std::unique_ptr<FastDdsRosDomain>> FastDdsRosDomain::join(const RosSettings& settings) {
  std::unique_ptr<FastDdsRosDomain> domain(new FastDdsRosDomain);
  if (auto created = domain->create(settings); !created) return tl::unexpected(created.error());
  return domain;
}

Result<void> FastDdsRosDomain::create(const RosSettings& settings) {
  edds::DomainParticipantQos qos;
  qos.name("tfdude-ros");
  qos.user_data().data_vec(user_data_of(settings.self));
  // Fast DDS 3 announces descriptions of types that others take for other types than their own.
  qos.properties().properties().emplace_back("fastdds.type_propagation", "disabled");
  set_network(settings.range, qos);
  auto& announcements = qos.wire_protocol().builtin.discovery_config.initial_announcements;
  announcements.count = 20;
  announcements.period = {0, 50'000'000};
  participant_ =
      factory().create_participant(settings.domain, qos, &listener_, edds::StatusMask::none());
  if (participant_ == nullptr) {
    return not_created("a participant in ROS domain " + std::to_string(settings.domain));
  }
  publisher_ = participant_->create_publisher(edds::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(edds::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ == nullptr || subscriber_ == nullptr) return not_created("its endpoints");
  return {};
}

FastDdsRosDomain::~FastDdsRosDomain() {
  if (participant_ == nullptr) return;
  (void)participant_->delete_contained_entities();
  (void)factory().delete_participant(participant_);
}

edds::Topic* FastDdsRosDomain::topic_of(const Topic& topic) {
  const std::string name = dds_name(topic);
  if (auto* known = participant_->lookup_topicdescription(name)) {
    return dynamic_cast<edds::Topic*>(known);
  }
  const edds::TypeSupport type = type_support(topic.type);
  if (!fastdds::ok(type.register_type(participant_))) return nullptr;
  return participant_->create_topic(name, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
}

Result<void> FastDdsRosDomain::subscribe(const Topic& topic, Take take) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto* described = topic_of(topic);
  if (described == nullptr) return not_created("the topic " + topic.name);
  readers_.push_back(reading(topic.type, std::move(take),
                             [this](const auto& prefix) { return bridges_.find(prefix); }));
  const auto* reader =
      subscriber_->create_datareader(described, reader_qos(topic), readers_.back().get());
  return reader == nullptr ? not_created("a reader of " + topic.name) : Result<void>();
}

Result<std::unique_ptr<Publisher>> FastDdsRosDomain::advertise(const Topic& topic) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto* described = topic_of(topic);
  if (described == nullptr) return not_created("the topic " + topic.name);
  auto* writer = publisher_->create_datawriter(described, writer_qos(topic));
  if (writer == nullptr) return not_created("a writer of " + topic.name);
  return writing(topic.type, *publisher_, *writer);
}

std::uint64_t FastDdsRosDomain::malformed() const { return malformed_samples(); }

Result<std::unique_ptr<RosDomain>> join_ros_domain(const RosSettings& settings) {
  auto domain = FastDdsRosDomain::join(settings);
  if (!domain) return tl::unexpected(std::move(domain.error()));
  return std::unique_ptr<RosDomain>(*std::move(domain));
}

}  // namespace tfdude::ros
