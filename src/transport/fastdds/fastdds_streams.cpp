#include "transport/fastdds/fastdds_transport.hpp"
#include "transport/fastdds/stream_channel.hpp"

// What is sent by threads that must not wait.
namespace tfdude::fastdds {

std::unique_ptr<Channel<Update>> FastDdsTransport::update_channel(const std::string& partition) {
  return std::make_unique<StreamChannel<Update, wire::Update>>(update_writers_.open(partition),
                                                               attention_);
}

std::unique_ptr<Channel<JointUpdate>> FastDdsTransport::joint_channel(
    const std::string& partition) {
  return std::make_unique<StreamChannel<JointUpdate, wire::Joints>>(joint_writers_.open(partition),
                                                                    attention_);
}

}  // namespace tfdude::fastdds
