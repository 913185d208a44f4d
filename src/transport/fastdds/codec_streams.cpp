#include <utility>

#include "base/stamp.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_values.hpp"

namespace tfdude::fastdds {

void write_wire(const Update& update, wire::Update& sample) {
  sample.edges().resize(update.edges.size());
  for (std::size_t i = 0; i < update.edges.size(); ++i) {
    sample.edges()[i].id(update.edges[i].id);
    write_transform(update.edges[i].X_PC, sample.edges()[i].x_pc());
  }
  sample.stamp(wire_stamp(update.stamp));
}

wire::Update to_wire(const Update& update) {
  wire::Update sample;
  write_wire(update, sample);
  return sample;
}

void write_wire(const JointUpdate& update, wire::Joints& sample) {
  sample.positions().resize(update.joints.size());
  for (std::size_t i = 0; i < update.joints.size(); ++i) {
    sample.positions()[i].id(update.joints[i].name);
    auto& numbers = sample.positions()[i].numbers();
    const auto& variance = update.joints[i].variance;
    numbers.resize(variance ? 2 : 1);
    numbers[0] = update.joints[i].position;
    if (variance) numbers[1] = *variance;
  }
  sample.stamp(wire_stamp(update.stamp));
}

wire::Joints to_wire(const JointUpdate& update) {
  wire::Joints sample;
  write_wire(update, sample);
  return sample;
}

wire::Clock to_wire(Time now) {
  wire::Clock sample;
  sample.stamp(nanoseconds(now));
  return sample;
}

Result<Time> from_wire(const wire::Clock& sample) {
  const Time now = time_of(sample.stamp());
  if (auto ok = check_stamp(now); !ok) return tl::unexpected(std::move(ok.error()));
  return now;
}

}  // namespace tfdude::fastdds
