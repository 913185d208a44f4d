#include <utility>

#include "base/log.hpp"
#include "transport/fastdds/fastdds_transport.hpp"
#include "transport/fastdds/kinds.hpp"
#include "transport/fastdds/topics.hpp"

// What becomes of samples that arrive.
namespace tfdude::fastdds {

void FastDdsTransport::take_request(const wire::Request& sample, const ertps::GuidPrefix_t& from) {
  if (peers_.is_incompatible(from)) return;
  const PeerId peer = peer_of(from);
  if (sample.body()._d() == kProbe) {
    wire::Reply alive;
    alive.body().alive(0);
    reply(peer, std::move(alive));
    return;
  }
  auto request = from_wire(sample);
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

void FastDdsTransport::take_reply(const wire::Reply& sample) {
  if (sample.body()._d() == kAlive) return;  // that it arrives says all
  auto reply = from_wire(sample);
  if (reply) {
    handler_->on_reply(*reply);
  } else {
    // Who awaits it gets the error; if nobody does, a stranger has sent it.
    if (reply.error().code != Errc::kUnsupported) log_refused(kReplyTopic, reply.error());
    handler_->on_reply(Reply{sample.sequence_number(), sample.epoch(), std::move(reply.error())});
  }
}

// Before Fast DDS 2.10 nothing but this keeps a participant from hearing itself.
void FastDdsTransport::take_page(const wire::Page& sample, const ertps::GuidPrefix_t& from) {
  if (peer_of(from) == self_ || peers_.is_incompatible(from)) return;
  const auto page = from_wire(sample);
  if (page) {
    handler_->on_page(*page);
    peers_.sent_page(from, *page);
  } else {
    log_refused(kDirectoryTopic, page.error());
  }
}

void FastDdsTransport::take_presence(const wire::Presence& sample,
                                     const ertps::GuidPrefix_t& from) {
  if (peer_of(from) == self_ || peers_.is_incompatible(from)) return;
  const auto presence = from_wire(sample);
  if (!presence) {
    log_refused(kPresenceTopic, presence.error());
    return;
  }
  peers_.present(from, *presence, sample.peers());
  attention_.raise();
}

}  // namespace tfdude::fastdds
