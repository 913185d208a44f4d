#include "transport/fastdds/topics.hpp"

#include <string>

#include "base/log.hpp"
#include "transport/fastdds/creation.hpp"

namespace tfdude::fastdds {

namespace {

template <class Type>
edds::TypeSupport counted(const std::shared_ptr<FastDdsCounters>& counters, const char* topic) {
  return edds::TypeSupport(new Type([counters, topic] { count_malformed(*counters, topic); }));
}

}  // namespace

Result<void> create_topics(edds::DomainParticipant& participant,
                           const std::shared_ptr<FastDdsCounters>& counters, Topics& topics) {
  Result<void> outcome;
  const auto create = [&](const char* name, const edds::TypeSupport& type) -> edds::Topic* {
    if (!outcome) return nullptr;
    const auto topic = created(std::string("the topic ") + name, [&]() -> edds::Topic* {
      if (!ok(type.register_type(&participant))) return nullptr;
      return participant.create_topic(name, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
    });
    if (!topic) outcome = tl::unexpected(topic.error());
    return topic.value_or(nullptr);
  };
  topics.presence = create(kPresenceTopic, counted<PresenceType>(counters, kPresenceTopic));
  topics.directory = create(kDirectoryTopic, counted<PageType>(counters, kDirectoryTopic));
  topics.reply = create(kReplyTopic, counted<ReplyType>(counters, kReplyTopic));
  topics.request = create(kRequestTopic, counted<RequestType>(counters, kRequestTopic));
  topics.change = create(kChangeTopic, counted<RequestType>(counters, kChangeTopic));
  topics.update = create(kUpdateTopic, counted<UpdateType>(counters, kUpdateTopic));
  topics.joint = create(kJointTopic, counted<JointsType>(counters, kJointTopic));
  topics.state = create(kStateTopic, counted<StateType>(counters, kStateTopic));
  topics.clock = create(kClockTopic, counted<ClockType>(counters, kClockTopic));
  return outcome;
}

void count_malformed(FastDdsCounters& counters, const char* topic) {
  const std::uint64_t before = counters.malformed.fetch_add(1, std::memory_order_relaxed);
  const std::uint64_t count = before + 1;
  if ((count & before) == 0) {
    log().warn("dropped a malformed DDS sample of topic {} ({} so far on all topics)", topic,
               count);
  }
}

void log_refused(const char* topic, const Error& error) {
  log().warn("rejected a DDS sample of topic {}: {}", topic, error.message);
}

}  // namespace tfdude::fastdds
