#include "transport/fastdds/entities.hpp"

#include <utility>

namespace tfdude::fastdds {

Outlet::Outlet(edds::DomainParticipant& participant, edds::Topic& topic,
               const std::string& partition, const std::string& profile, FastDdsCounters& counters,
               std::function<void()> on_reader)
    : participant_(participant), counters_(counters), on_reader_(std::move(on_reader)) {
  edds::PublisherQos qos = participant.get_default_publisher_qos();
  if (!partition.empty()) qos.partition().push_back(partition.c_str());
  publisher_ = participant.create_publisher(qos);
  if (publisher_ == nullptr) return;
  writer_ = publisher_->create_datawriter(&topic, writer_qos(*publisher_, profile), this);
  if (writer_ != nullptr) ++counters_.writers;
}

Outlet::~Outlet() {
  if (writer_ != nullptr && ok(publisher_->delete_datawriter(writer_))) --counters_.writers;
  if (publisher_ != nullptr) participant_.delete_publisher(publisher_);
}

bool Outlet::wait_until_matched(Deadline deadline) {
  std::unique_lock lock(mutex_);
  return matched_.wait_until(lock, deadline, [this] { return readers_ > 0; });
}

void Outlet::on_publication_matched(edds::DataWriter*,
                                    const edds::PublicationMatchedStatus& status) {
  bool one_more = false;
  {
    const std::lock_guard lock(mutex_);
    one_more = status.current_count > readers_;
    readers_ = status.current_count;
  }
  matched_.notify_all();
  if (one_more && on_reader_) on_reader_();
}

}  // namespace tfdude::fastdds
