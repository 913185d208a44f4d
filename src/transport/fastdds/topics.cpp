#include "transport/fastdds/topics.hpp"

#include <string>

#include "base/log.hpp"
#include "transport/fastdds/creation.hpp"

namespace tfdude::fastdds {

Result<void> create_topics(edds::DomainParticipant& participant, Topics& topics) {
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
  topics.presence = create(kPresenceTopic, edds::TypeSupport(new PresenceType));
  topics.directory = create(kDirectoryTopic, edds::TypeSupport(new PageType));
  topics.reply = create(kReplyTopic, edds::TypeSupport(new ReplyType));
  topics.request = create(kRequestTopic, edds::TypeSupport(new RequestType));
  topics.change = create(kChangeTopic, edds::TypeSupport(new RequestType));
  topics.update = create(kUpdateTopic, edds::TypeSupport(new UpdateType));
  topics.joint = create(kJointTopic, edds::TypeSupport(new JointsType));
  topics.state = create(kStateTopic, edds::TypeSupport(new StateType));
  topics.clock = create(kClockTopic, edds::TypeSupport(new ClockType));
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
