#include "transport/fastdds/clock_channel.hpp"

#include <utility>

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {

ClockChannel::ClockChannel(const Context& context, edds::Topic& topic,
                           std::function<void(Time)> on_clock)
    : context_(context), topic_(topic) {
  if (!on_clock) return;
  const auto take = [on_clock = std::move(on_clock)](const wire::Clock& sample,
                                                     const edds::SampleInfo&) {
    const auto now = from_wire(sample);
    if (!now) return log_refused(kClockTopic, now.error());
    on_clock(*now);
  };
  reader_ = std::make_unique<Reader<wire::Clock>>(context_, topic_, "", "call_reader",
                                                  Reader<wire::Clock>::Calls{take, nullptr});
}

Result<void> ClockChannel::publish(Time now) {
  std::shared_ptr<Writer> writer;
  {
    const Lock lock(mutex_);
    if (writer_ == nullptr || !writer_->good()) {
      writer_ = std::make_shared<Writer>(context_, topic_, "", "call_writer");
    }
    writer = writer_;
  }
  wire::Clock sample = to_wire(now);
  if (!writer->good()) return writer->check();
  if (writer->write(&sample)) return {};
  return fail(Errc::kTransport, "the time could not be published");
}

}  // namespace tfdude::fastdds
