#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "partition/requests.hpp"
#include "transport/fastdds/fastdds_transport.hpp"
#include "transport/fastdds/topics.hpp"

// What becomes of samples that arrive.
namespace tfdude::fastdds {

void FastDdsTransport::take_request(const wire::Request& sample, const ertps::GuidPrefix_t& from,
                                    bool may_change) {
  if (peers_.is_incompatible(from)) return;
  const PeerId peer = peer_of(from);
  if (sample.body()._d() == kProbe) {
    wire::Reply alive;
    alive.body().alive(0);
    reply(peer, alive);
    return;
  }
  auto request = from_wire(sample);
  if (request && is_change(*request) && !may_change) {
    request = fail(Errc::kNotPermitted, "only requests of topic " + std::string(kChangeTopic) +
                                            " may " + attempt_of(*request) + " in partition " +
                                            quote(options_.partition));
  }
  // The sender repeats it, if it still waits; by then it is decided which process serves.
  const auto is_dropped = [this] {
    return peers_.may_be_replaced() || peers_.was_held_up(Peers::Clock::now());
  };
  if (request && is_change(*request) && is_dropped()) return;
  if (request) {
    handler_->on_request(peer, *request);
    return;
  }
  log_refused(kRequestTopic, request.error());
  reply(peer, Reply{sample.sequence_number(), 0, std::move(request.error())});
}

void FastDdsTransport::take_update(const wire::Update& sample) {
  const auto update = from_wire(sample, [this](std::string_view id) { return handler_->owns(id); });
  if (update) {
    handler_->on_update(*update);
  } else {
    log_refused(kUpdateTopic, update.error());
  }
}

void FastDdsTransport::take_joints(const wire::Joints& sample) {
  const auto has = [this](std::string_view name) { return handler_->owns_joint(name); };
  const auto update = from_wire(sample, has);
  if (update) {
    handler_->on_joints(*update);
  } else {
    log_refused(kJointTopic, update.error());
  }
}

// A reply is believed only from whom was asked: it names the owner whose partition it came through.
void FastDdsTransport::take_reply(const wire::Reply& sample, const edds::SampleInfo& info) {
  const ertps::GUID_t& writer = writer_of(info);
  peers_.replied(writer.guidPrefix);
  if (sample.body()._d() == kAlive) return;  // that it arrives says all
  std::string owner = reply_paths_.owner(writer);
  if (owner.empty()) owner = owner_of_replies(writer_partitions_.of(writer));
  auto reply = from_wire(sample);
  if (reply) {
    reply->sent = Time(std::chrono::nanoseconds(info.source_timestamp.to_ns()));
    handler_->on_reply(owner, *reply);
  } else {
    // The caller that awaits it gets the error; if there is none, a stranger has sent it.
    if (reply.error().code != Errc::kUnsupported) log_refused(kReplyTopic, reply.error());
    handler_->on_reply(owner,
                       Reply{sample.sequence_number(), sample.epoch(), std::move(reply.error())});
  }
}

// Before Fast DDS 2.10 nothing but this keeps a participant from hearing itself.
bool FastDdsTransport::ignores(const ertps::GUID_t& writer) const {
  return peer_of(writer.guidPrefix) == self_ || peers_.is_incompatible(writer.guidPrefix);
}

// Whether a message about a partition was written in the DDS partition of that name.
bool FastDdsTransport::is_of(const std::string& partition, const ertps::GUID_t& writer,
                             const char* topic) const {
  const std::string written_in = writer_partitions_.of(writer);
  if (written_in == partition) return true;
  log_refused(topic, Error{Errc::kNotPermitted, "it is about partition " + quote(partition) +
                                                    ", but was written in the DDS partition " +
                                                    quote(written_in)});
  return false;
}

void FastDdsTransport::take_page(const wire::Page& sample, const ertps::GUID_t& writer) {
  if (ignores(writer)) return;
  const auto page = from_wire(sample);
  if (!page) return log_refused(kDirectoryTopic, page.error());
  if (!is_of(page->partition, writer, kDirectoryTopic)) return;
  handler_->on_page(*page);
  peers_.sent_page(writer.guidPrefix, *page);
}

void FastDdsTransport::take_presence(const wire::Presence& sample, const ertps::GUID_t& writer) {
  if (ignores(writer)) return;
  const auto presence = from_wire(sample);
  if (!presence) return log_refused(kPresenceTopic, presence.error());
  if (!is_of(presence->partition, writer, kPresenceTopic)) return;
  peers_.present(writer.guidPrefix, *presence, sample.peers());
  attention_.raise();
}

}  // namespace tfdude::fastdds
