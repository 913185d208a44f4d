#include "transport/fastdds/entities.hpp"

#include <utility>

namespace tfdude::fastdds {

Outlet::Outlet(const Context& context, edds::Topic& topic, const std::string& partition,
               const std::string& profile, std::function<void()> on_reader)
    : context_(context), on_reader_(std::move(on_reader)) {
  edds::PublisherQos qos = context.participant.get_default_publisher_qos();
  if (!partition.empty()) qos.partition().push_back(partition.c_str());
  publisher_ = context.participant.create_publisher(qos);
  if (publisher_ == nullptr) return;
  writer_ = publisher_->create_datawriter(&topic, context.profiles.writer(*publisher_, profile), this);
  if (writer_ != nullptr) ++context_.counters.writers;
}

Outlet::~Outlet() {
  const Gate::Pause pause(context_.gate);
  if (writer_ != nullptr && ok(publisher_->delete_datawriter(writer_))) --context_.counters.writers;
  if (publisher_ != nullptr) context_.participant.delete_publisher(publisher_);
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
