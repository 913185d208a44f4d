#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <variant>
#include <vector>

#include "partition/messages.hpp"

namespace tfdude::simulation {

/// What is sent. The first: what DDS sends of itself, which is not counted.
using Message = std::variant<std::monostate, const Presence*, const Page*, const Request*,
                             const Reply*, const Update*, const JointUpdate*, const PushedValues*>;

/// Messages and their bytes.
struct Count {
  double messages = 0;
  double bytes = 0;
};

/// What one participant has sent and received.
struct Load {
  Count written;  ///< each message once, however many receive it, as if all of it were multicast
  Count sent;     ///< a message once for each receiver, as DDS sends to the addresses of each
  Count received;
  double heard = 0;   ///< announcements of others
  double probes = 0;  ///< requests for a sign of life, each with its reply
};

/// Counts the messages of each process.
class Traffic {
 public:
  /// @param bytes  the size of a message
  explicit Traffic(std::function<std::size_t(const Message&)> bytes) : bytes_(std::move(bytes)) {}

  void wrote(std::uint64_t from, const Message& message);
  /// @return its bytes
  std::size_t sent(std::uint64_t from, const Message& message);
  /// @param bytes  as sent() has returned; 0: it does not count
  void received(std::uint64_t to, std::size_t bytes);
  void heard_announcement(std::uint64_t to) { ++of(to).heard; }
  void asked_for_life(std::uint64_t from) { ++of(from).probes; }

  /// The load of each process since the last call, by its number.
  [[nodiscard]] std::vector<Load> take() { return std::exchange(loads_, {}); }

 private:
  [[nodiscard]] Load& of(std::uint64_t process);
  [[nodiscard]] std::size_t size_of(const Message& message) const;

  const std::function<std::size_t(const Message&)> bytes_;
  std::vector<Load> loads_;
};

}  // namespace tfdude::simulation
