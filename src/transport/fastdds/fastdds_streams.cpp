#include "transport/fastdds/fastdds_transport.hpp"
#include "transport/fastdds/stream_channel.hpp"

// What is sent by threads that must not wait.
namespace tfdude::fastdds {

std::unique_ptr<Channel<Update>> FastDdsTransport::update_channel(const std::string& partition) {
  return std::make_unique<StreamChannel<Update, wire::Update>>(
      writer(update_writers_, topics_.update, partition, "update_writer"));
}

std::unique_ptr<Channel<JointUpdate>> FastDdsTransport::joint_channel(
    const std::string& partition) {
  return std::make_unique<StreamChannel<JointUpdate, wire::Joints>>(
      writer(joint_writers_, topics_.joint, partition, "update_writer"));
}

}  // namespace tfdude::fastdds
