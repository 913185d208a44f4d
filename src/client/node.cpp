#include "tfdude/client/node.hpp"

#include "tfdude/base/id.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "runtime/participant.hpp"

namespace tfdude {
Result<Node> Node::open(const std::string& partition, const std::vector<FrameSpec>& frames,
                        const NodeOptions& options) {
  if (auto ok = check_new_partition_name(partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  auto transport = make_fastdds_transport({options.domain, options.profile, partition, nullptr,
                                           options.discovery_server, options.keys});
  if (!transport) return tl::unexpected(std::move(transport.error()));
  return open(*std::move(transport), partition, frames, options);
}

Result<Node> Node::open(TransportPtr transport, const std::string& partition,
                        const std::vector<FrameSpec>& frames, const NodeOptions& options) {
  if (auto ok = check_new_partition_name(partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  auto participant = std::make_unique<Participant>(std::move(transport), partition, options);
  if (auto started = participant->start(); !started)
    return tl::unexpected(std::move(started.error()));
  if (auto serving = participant->serve(frames); !serving) {
    return tl::unexpected(std::move(serving.error()));
  }
  return Node(std::move(participant));
}

std::size_t Node::own_frames() const { return participant_->queries().own_frames(); }

Result<void> Node::clear_history(const std::string& id) { return participant_->clear_history(id); }

std::size_t Node::clear_history() { return participant_->clear_histories(Time::min()); }

Result<void> Node::set_timing(const std::string& id, const EdgeTiming& timing) {
  return participant_->forest().set_timing(id, timing);
}

void Node::show_joints(std::vector<JointInfo> joints) {
  participant_->member().show(std::move(joints));
}

Result<void> Node::release(const std::vector<std::string>& ids) {
  return participant_->member().release(ids, participant_->discovery().call_deadline());
}

bool Node::responds(Milliseconds wait) { return participant_->responds(wait); }

Subscription Node::on_taken(std::function<void(const Change&)> listener) {
  return Subscription(participant_->member().on_taken(std::move(listener)));
}

RefusedCounts Node::refused() const { return participant_->refused(); }

const std::string& Node::partition() const { return participant_->member().name(); }

}  // namespace tfdude
