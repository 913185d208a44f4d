#pragma once

#include <memory>
#include <optional>
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
  /// @param writer  null: this participant may not stream there
  StreamChannel(std::shared_ptr<Writer> writer, Attention& attention)
      : writer_(std::move(writer)), attention_(attention) {}

  std::optional<Errc> try_send(const Message& message) override {
    if (writer_ == nullptr) return Errc::kNotPermitted;
    if (!writer_->good()) return Errc::kTransport;
    if (!writer_->matched()) return Errc::kTimeout;
    attention_.pay(*writer_);
    write_wire(message, sample_);
    return writer_->write(&sample_) ? std::nullopt : std::optional<Errc>(Errc::kTimeout);
  }

 private:
  const std::shared_ptr<Writer> writer_;
  Attention& attention_;
  Sample sample_;
};

}  // namespace tfdude::fastdds
