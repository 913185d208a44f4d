#pragma once

#include <memory>
#include <utility>

#include "transport/fastdds/attention.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/port.hpp"

namespace tfdude::fastdds {

/// Writes messages of one kind at once, through a sample that is kept for its memory.
template <class Message, class Sample>
class StreamChannel final : public Channel<Message> {
 public:
  StreamChannel(std::shared_ptr<Writer> writer, Attention& attention)
      : writer_(std::move(writer)), attention_(attention) {}

  bool try_send(const Message& message) override {
    if (!writer_->good() || !writer_->matched()) return false;
    attention_.pay(*writer_);
    write_wire(message, sample_);
    return writer_->write(&sample_);
  }

 private:
  const std::shared_ptr<Writer> writer_;
  Attention& attention_;
  Sample sample_;
};

}  // namespace tfdude::fastdds
