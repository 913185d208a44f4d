#include "simulation/traffic.hpp"

namespace tfdude::simulation {
namespace {

void add(Count& count, std::size_t bytes) {
  if (bytes == 0) return;
  ++count.messages;
  count.bytes += static_cast<double>(bytes);
}

}  // namespace

Load& Traffic::of(std::uint64_t process) {
  if (process >= loads_.size()) loads_.resize(process + 1);
  return loads_[process];
}

std::size_t Traffic::size_of(const Message& message) const {
  return std::holds_alternative<std::monostate>(message) ? 0 : bytes_(message);
}

void Traffic::wrote(std::uint64_t from, const Message& message) {
  add(of(from).written, size_of(message));
}

std::size_t Traffic::sent(std::uint64_t from, const Message& message) {
  const std::size_t bytes = size_of(message);
  add(of(from).sent, bytes);
  return bytes;
}

void Traffic::received(std::uint64_t to, std::size_t bytes) { add(of(to).received, bytes); }

}  // namespace tfdude::simulation
