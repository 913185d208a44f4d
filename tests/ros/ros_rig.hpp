#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude::testing {

/// A foreign node of ROS: examples/ros/peer.c, which obeys lines.
class RosPeer {
 public:
  /// @param typed  whether it announces descriptions of its types
  explicit RosPeer(std::uint32_t domain, bool typed = false);
  ~RosPeer();
  RosPeer(const RosPeer&) = delete;
  RosPeer& operator=(const RosPeer&) = delete;

  void obey(const std::string& line);
  /// Advertises, and waits until a reader is matched.
  void advertise(const std::string& topic, const std::string& kind, const std::string& profile);
  void publish(const std::string& topic, const std::string& message);

  /// The rest of the next line that begins with this. @throws std::runtime_error if none comes.
  [[nodiscard]] std::string next(const std::string& beginning);
  /// The same if it was printed already.
  [[nodiscard]] std::optional<std::string> try_next(const std::string& beginning);

  Process& process() { return *process_; }

 private:
  TemporaryDirectory directory_;
  int commands_ = -1;
  std::optional<Process> process_;
  std::size_t read_ = 0;  // bytes of its output that were returned
};

/// One transform as peers write and print it.
struct RosTransform {
  std::string parent;
  std::string child;
  Pose X_PC;
};

/// The same as received.
struct ReceivedTransform : RosTransform {
  Time stamp;
};
[[nodiscard]] std::vector<ReceivedTransform> parse_tf(const std::string& line);

/// A message for RosPeer::publish().
[[nodiscard]] std::string tf_message(Time stamp, const std::vector<RosTransform>& transforms);

/// The environment by which programs of Cyclone DDS stay on this computer.
[[nodiscard]] const std::string& cyclone_on_loopback();

/// The bridge, in a domain of tf-dude and one of ROS.
class RosRig {
 public:
  RosRig();

  [[nodiscard]] const TestDomain& dude() const { return dude_; }
  [[nodiscard]] std::uint32_t ros_domain() const { return ros_->number(); }

  /// Starts a bridge and waits until it is ready.
  [[nodiscard]] Process start_bridge(const std::vector<std::string>& arguments = {}) const {
    return start_bridge(dude_.number(), arguments);
  }
  /// The same in another domain of tf-dude.
  [[nodiscard]] Process start_bridge(std::uint32_t dude,
                                     const std::vector<std::string>& arguments) const;
  [[nodiscard]] Client client() const { return Client::open(dude_.options()).value(); }

 private:
  TestDomain dude_;
  std::unique_ptr<DomainLease> ros_;
};

}  // namespace tfdude::testing
