#pragma once

#include <memory>
#include <utility>

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/port.hpp"

namespace tfdude::fastdds {

/// Writes messages of one kind at once, through a sample that is kept for its memory.
template <class Message, class Sample>
class StreamChannel final : public Channel<Message> {
 public:
  explicit StreamChannel(std::shared_ptr<Outlet> outlet) : outlet_(std::move(outlet)) {}

  bool try_send(const Message& message) override {
    if (!outlet_->good() || !outlet_->matched()) return false;
    write_wire(message, sample_);
    return outlet_->write(&sample_);
  }

 private:
  const std::shared_ptr<Outlet> outlet_;
  Sample sample_;
};

}  // namespace tfdude::fastdds
