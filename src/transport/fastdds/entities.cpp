#include "transport/fastdds/entities.hpp"

namespace tfdude::fastdds {

Outlet::Outlet(edds::DomainParticipant& participant, edds::Topic& topic,
               const std::string& partition, const std::string& profile)
    : participant_(participant) {
  edds::PublisherQos qos = participant.get_default_publisher_qos();
  if (!partition.empty()) qos.partition().push_back(partition.c_str());
  publisher_ = participant.create_publisher(qos);
  if (publisher_ == nullptr) return;
  writer_ = publisher_->create_datawriter(&topic, writer_qos(*publisher_, profile), this);
}

Outlet::~Outlet() {
  if (writer_ != nullptr) publisher_->delete_datawriter(writer_);
  if (publisher_ != nullptr) participant_.delete_publisher(publisher_);
}

bool Outlet::wait_until_matched(Deadline deadline) {
  std::unique_lock lock(mutex_);
  return matched_.wait_until(lock, deadline, [this] { return readers_ > 0; });
}

void Outlet::on_publication_matched(edds::DataWriter*,
                                    const edds::PublicationMatchedStatus& status) {
  {
    const std::lock_guard lock(mutex_);
    readers_ = status.current_count;
  }
  matched_.notify_all();
}

}  // namespace tfdude::fastdds
