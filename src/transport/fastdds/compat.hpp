#pragma once

// All that differs in the source between Fast DDS 2.9 (Debian 12) and 3.1 (Debian 13), but for how
// datagrams are sent (send_filter.hpp).

#if TFDUDE_FASTDDS_MAJOR == 2
#include <tfdudePubSubTypes.h>

#include <fastdds/dds/core/policy/QosPolicies.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/ContentFilteredTopic.hpp>
#include <fastdds/dds/topic/IContentFilter.hpp>
#include <fastdds/dds/topic/IContentFilterFactory.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#else
#include <fastdds/dds/core/ReturnCode.hpp>
#include <fastdds/dds/core/policy/QosPolicies.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/log/StdoutErrConsumer.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/ContentFilteredTopic.hpp>
#include <fastdds/dds/topic/IContentFilter.hpp>
#include <fastdds/dds/topic/IContentFilterFactory.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/common/WriteParams.hpp>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>
#include <tfdudePubSubTypes.hpp>
#endif

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tfdude::fastdds {

namespace edds = eprosima::fastdds::dds;
namespace etransport = eprosima::fastdds::rtps;

/// What decides about the matches of an endpoint, and where it is, as one number.
template <class Locators>
std::uint64_t number_of_settings(std::string topic, const std::vector<std::string>& partitions,
                                 int reliability, int durability, const Locators& locators) {
  std::string all = std::move(topic);
  for (const std::string& partition : partitions) all.append(1, '\0').append(partition);
  all.append(1, '\0').append(std::to_string(reliability)).append(std::to_string(durability));
  for (const auto& at : locators) {
    all.append(reinterpret_cast<const char*>(at.address), sizeof at.address);
    all.append(std::to_string(at.port));
  }
  return std::hash<std::string>()(all);
}

#if TFDUDE_FASTDDS_MAJOR == 2

namespace ertps = eprosima::fastrtps::rtps;
using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;
using ParticipantInfo = ertps::ParticipantDiscoveryInfo;
using DiscoveryProtocol = ertps::DiscoveryProtocol_t;

inline bool ok(const ReturnCode& code) { return code == ReturnCode::RETCODE_OK; }
inline ReturnCode bad_parameter() { return ReturnCode::RETCODE_BAD_PARAMETER; }
inline ReturnCode done() { return ReturnCode::RETCODE_OK; }

inline bool write(edds::DataWriter& writer, void* data, ertps::WriteParams& params) {
  return writer.write(data, params);
}

inline std::string name_of(const edds::TopicDataType& type) { return type.getName(); }

/// Plain CDR of XCDR1 only, as ROS 2 has it.
inline void use_plain_cdr(edds::DataWriterQos& qos) {
  qos.representation().m_value = {edds::XCDR_DATA_REPRESENTATION};
}
inline void use_plain_cdr(edds::DataReaderQos& qos) {
  qos.type_consistency().representation.m_value = {edds::XCDR_DATA_REPRESENTATION};
}

inline void set_heartbeat_period(edds::DataWriterQos& qos, std::uint32_t nanoseconds) {
  qos.reliable_writer_qos().times.heartbeatPeriod = {0, nanoseconds};
}

/// Elements of XML profiles that have another name in this version than in profiles/tfdude.xml.
inline constexpr std::array<std::pair<const char*, const char*>, 0> kRenamedElements{};

/// Makes a participant discover the others by a discovery server. A participant of this version
/// also identifies a server by its id: 0 by default, as for the servers.
inline void discover_by_server(ertps::DiscoverySettings& discovery, const ertps::Locator_t& at) {
  etransport::RemoteServerAttributes server;
  // Not as text, which Fast DDS reads with the locale of the program.
  constexpr std::array<ertps::octet, 12> kServer{0x44, 0x53, 0x00, 0x5f, 0x45, 0x50,
                                                 0x52, 0x4f, 0x53, 0x49, 0x4d, 0x41};
  std::copy(kServer.begin(), kServer.end(), server.guidPrefix.value);
  server.metatrafficUnicastLocatorList.push_back(at);
  discovery.discoveryProtocol = DiscoveryProtocol::CLIENT;
  discovery.m_DiscoveryServers = {server};
}

/// Reports participants: met(guid prefix, name, user data), changed(the same, when that changes),
/// left(guid prefix), authenticated(guid prefix, verified); writers: writer_found(guid, topic, DDS
/// partitions), writer_lost(guid); and all endpoints: endpoint_found(guid, number of its settings),
/// also when they may have changed, endpoint_lost(guid). A writer is reported before it is matched.
template <class Observer>
class ParticipantListener final : public edds::DomainParticipantListener {
 public:
  explicit ParticipantListener(Observer& observer) : observer_(observer) {}

  void on_participant_discovery(edds::DomainParticipant*, ParticipantInfo&& info) override {
    const auto& prefix = info.info.m_guid.guidPrefix;
    if (info.status == ParticipantInfo::DISCOVERED_PARTICIPANT) {
      observer_.met(prefix, info.info.m_participantName.to_string(),
                    info.info.m_userData.data_vec());
    } else if (info.status == ParticipantInfo::CHANGED_QOS_PARTICIPANT) {
      observer_.changed(prefix, info.info.m_participantName.to_string(),
                        info.info.m_userData.data_vec());
    } else {
      observer_.left(prefix);
    }
  }

  void onParticipantAuthentication(edds::DomainParticipant*,
                                   ertps::ParticipantAuthenticationInfo&& info) override {
    observer_.authenticated(
        info.guid.guidPrefix,
        info.status == ertps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT);
  }

  void on_publisher_discovery(edds::DomainParticipant*,
                              ertps::WriterDiscoveryInfo&& info) override {
    if (info.status == ertps::WriterDiscoveryInfo::DISCOVERED_WRITER) {
      observer_.writer_found(info.info.guid(), info.info.topicName().to_string(),
                             info.info.m_qos.m_partition.getNames());
    } else if (info.status == ertps::WriterDiscoveryInfo::REMOVED_WRITER) {
      observer_.writer_lost(info.info.guid());
    }
    using Info = ertps::WriterDiscoveryInfo;
    report(info.info, info.status == Info::DISCOVERED_WRITER, info.status == Info::REMOVED_WRITER,
           info.status == Info::CHANGED_QOS_WRITER);
  }

  void on_subscriber_discovery(edds::DomainParticipant*,
                               ertps::ReaderDiscoveryInfo&& info) override {
    using Info = ertps::ReaderDiscoveryInfo;
    report(info.info, info.status == Info::DISCOVERED_READER, info.status == Info::REMOVED_READER,
           info.status == Info::CHANGED_QOS_READER);
  }

 private:
  template <class Endpoint>
  void report(const Endpoint& endpoint, bool is_new, bool is_gone, bool has_changed) {
    if (is_gone) observer_.endpoint_lost(endpoint.guid());
    if (!is_new && !has_changed) return;
    const auto& qos = endpoint.m_qos;
    observer_.endpoint_found(
        endpoint.guid(),
        number_of_settings(endpoint.topicName().to_string(), qos.m_partition.getNames(),
                           qos.m_reliability.kind, qos.m_durability.kind,
                           endpoint.remote_locators().unicast));
  }

  Observer& observer_;
};

/// A generated type that rejects payloads that are not well formed before it deserializes them. Its
/// key is computed without the buffer that the generated code shares between threads. It
/// preallocates for usual DDS samples, not for the largest.
template <class Generated, bool (*WellFormed)(const std::uint8_t*, std::size_t)>
class CheckedType final : public Generated {
 public:
  /// @param on_malformed  called for each payload that is rejected, by any thread
  explicit CheckedType(std::function<void()> on_malformed = [] {})
      : on_malformed_(std::move(on_malformed)) {
    this->m_typeSize = kUsualSize;
  }

  bool deserialize(ertps::SerializedPayload_t* payload, void* data) override {
    if (WellFormed(payload->data, payload->length)) return Generated::deserialize(payload, data);
    on_malformed_();
    return false;
  }

  bool getKey(void* data, ertps::InstanceHandle_t* handle, bool force_md5) override {
    thread_local Generated own_buffer;
    return own_buffer.getKey(data, handle, force_md5);
  }

 private:
  static constexpr std::uint32_t kUsualSize = 512;
  const std::function<void()> on_malformed_;
};

#else

namespace ertps = eprosima::fastdds::rtps;
using ReturnCode = edds::ReturnCode_t;
using DiscoveryProtocol = ertps::DiscoveryProtocol;

inline bool ok(ReturnCode code) { return code == edds::RETCODE_OK; }
inline ReturnCode bad_parameter() { return edds::RETCODE_BAD_PARAMETER; }
inline ReturnCode done() { return edds::RETCODE_OK; }

inline bool write(edds::DataWriter& writer, void* data, ertps::WriteParams& params) {
  return ok(writer.write(data, params));
}

inline std::string name_of(const edds::TopicDataType& type) { return type.get_name(); }

inline void use_plain_cdr(edds::DataWriterQos& qos) {
  qos.representation().m_value = {edds::XCDR_DATA_REPRESENTATION};
}
inline void use_plain_cdr(edds::DataReaderQos& qos) {
  qos.representation().m_value = {edds::XCDR_DATA_REPRESENTATION};
}

inline void set_heartbeat_period(edds::DataWriterQos& qos, std::uint32_t nanoseconds) {
  qos.reliable_writer_qos().times.heartbeat_period = {0, nanoseconds};
}

inline constexpr std::array<std::pair<const char*, const char*>, 6> kRenamedElements{{
    {"initialHeartbeatDelay", "initial_heartbeat_delay"},
    {"heartbeatPeriod", "heartbeat_period"},
    {"nackResponseDelay", "nack_response_delay"},
    {"nackSupressionDuration", "nack_supression_duration"},
    {"initialAcknackDelay", "initial_acknack_delay"},
    {"heartbeatResponseDelay", "heartbeat_response_delay"},
}};

inline void discover_by_server(ertps::DiscoverySettings& discovery, const ertps::Locator_t& at) {
  discovery.discoveryProtocol = DiscoveryProtocol::CLIENT;
  discovery.m_DiscoveryServers.clear();
  discovery.m_DiscoveryServers.push_back(at);
}

template <class Observer>
class ParticipantListener final : public edds::DomainParticipantListener {
 public:
  explicit ParticipantListener(Observer& observer) : observer_(observer) {}

  void on_participant_discovery(edds::DomainParticipant*, ertps::ParticipantDiscoveryStatus reason,
                                const edds::ParticipantBuiltinTopicData& info, bool&) override {
    const auto& prefix = info.guid.guidPrefix;
    if (reason == ertps::ParticipantDiscoveryStatus::DISCOVERED_PARTICIPANT) {
      observer_.met(prefix, info.participant_name.to_string(), info.user_data.data_vec());
    } else if (reason == ertps::ParticipantDiscoveryStatus::CHANGED_QOS_PARTICIPANT) {
      observer_.changed(prefix, info.participant_name.to_string(), info.user_data.data_vec());
    } else {
      observer_.left(prefix);
    }
  }

  void onParticipantAuthentication(edds::DomainParticipant*,
                                   ertps::ParticipantAuthenticationInfo&& info) override {
    observer_.authenticated(
        info.guid.guidPrefix,
        info.status == ertps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT);
  }

  void on_data_writer_discovery(edds::DomainParticipant*, ertps::WriterDiscoveryStatus reason,
                                const edds::PublicationBuiltinTopicData& info, bool&) override {
    if (reason == ertps::WriterDiscoveryStatus::DISCOVERED_WRITER) {
      observer_.writer_found(info.guid, info.topic_name.to_string(), info.partition.getNames());
    } else if (reason == ertps::WriterDiscoveryStatus::REMOVED_WRITER) {
      observer_.writer_lost(info.guid);
    }
    using Status = ertps::WriterDiscoveryStatus;
    report(info, reason == Status::DISCOVERED_WRITER, reason == Status::REMOVED_WRITER,
           reason == Status::CHANGED_QOS_WRITER);
  }

  void on_data_reader_discovery(edds::DomainParticipant*, ertps::ReaderDiscoveryStatus reason,
                                const edds::SubscriptionBuiltinTopicData& info, bool&) override {
    using Status = ertps::ReaderDiscoveryStatus;
    report(info, reason == Status::DISCOVERED_READER, reason == Status::REMOVED_READER,
           reason == Status::CHANGED_QOS_READER);
  }

 private:
  template <class Endpoint>
  void report(const Endpoint& endpoint, bool is_new, bool is_gone, bool has_changed) {
    if (is_gone) observer_.endpoint_lost(endpoint.guid);
    if (!is_new && !has_changed) return;
    observer_.endpoint_found(
        endpoint.guid,
        number_of_settings(endpoint.topic_name.to_string(), endpoint.partition.getNames(),
                           endpoint.reliability.kind, endpoint.durability.kind,
                           endpoint.remote_locators.unicast));
  }

  Observer& observer_;
};

template <class Generated, bool (*WellFormed)(const std::uint8_t*, std::size_t)>
class CheckedType final : public Generated {
 public:
  explicit CheckedType(std::function<void()> on_malformed = [] {})
      : on_malformed_(std::move(on_malformed)) {
    this->max_serialized_type_size = kUsualSize;
  }

  bool deserialize(ertps::SerializedPayload_t& payload, void* data) override {
    if (WellFormed(payload.data, payload.length)) return Generated::deserialize(payload, data);
    on_malformed_();
    return false;
  }

  bool compute_key(ertps::SerializedPayload_t& payload, ertps::InstanceHandle_t& handle,
                   bool force_md5) override {
    thread_local Generated own_buffer;
    return WellFormed(payload.data, payload.length) &&
           own_buffer.compute_key(payload, handle, force_md5);
  }

  bool compute_key(const void* const data, ertps::InstanceHandle_t& handle,
                   bool force_md5) override {
    thread_local Generated own_buffer;
    return own_buffer.compute_key(data, handle, force_md5);
  }

 private:
  static constexpr std::uint32_t kUsualSize = 512;
  const std::function<void()> on_malformed_;
};

#endif

/// With the clock's time as its source timestamp.
inline bool write(edds::DataWriter& writer, void* data) {
  ertps::WriteParams params;
  return write(writer, data, params);
}

}  // namespace tfdude::fastdds
