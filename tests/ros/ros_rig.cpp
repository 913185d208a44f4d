#include "ros_rig.hpp"

#include <fcntl.h>
#include <sstream>
#include <stdexcept>
#include <sys/stat.h>
#include <unistd.h>

namespace tfdude::testing {

const std::string& cyclone_on_loopback() {
  static const std::string variable =
      "CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces>"
      "<NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/>"
      "</Interfaces></General></Domain></CycloneDDS>";
  return variable;
}

RosPeer::RosPeer(std::uint32_t domain, bool typed) {
  const std::string path = directory_.path() + "/commands";
  if (mkfifo(path.c_str(), 0600) != 0) throw std::runtime_error("cannot create " + path);
  // Read and write: opening it does not wait for the peer.
  commands_ = open(path.c_str(), O_RDWR | O_CLOEXEC);
  process_.emplace(std::vector<std::string>{"/usr/bin/env", cyclone_on_loopback(),
                                            typed ? TFDUDE_TYPED_ROS_PEER : TFDUDE_ROS_PEER,
                                            std::to_string(domain), path});
}

RosPeer::~RosPeer() { close(commands_); }

void RosPeer::obey(const std::string& line) {
  const std::string text = line + '\n';
  std::size_t written = 0;
  while (written < text.size()) {
    const auto count = write(commands_, text.data() + written, text.size() - written);
    if (count <= 0) throw std::runtime_error("the peer does not read: " + process_->err());
    written += static_cast<std::size_t>(count);
  }
}

void RosPeer::advertise(const std::string& topic, const std::string& kind,
                        const std::string& profile) {
  obey("advertise " + topic + ' ' + kind + ' ' + profile);
  (void)next("matched " + topic);
}

void RosPeer::publish(const std::string& topic, const std::string& message) {
  obey("publish " + topic + ' ' + message);
}

std::optional<std::string> RosPeer::try_next(const std::string& beginning) {
  (void)process_->runs();  // reads its output
  const std::string& out = process_->out();
  for (std::size_t end = out.find('\n', read_); end != std::string::npos;
       end = out.find('\n', read_)) {
    const std::string line = out.substr(read_, end - read_);
    read_ = end + 1;
    if (line.compare(0, beginning.size(), beginning) == 0) return line.substr(beginning.size());
  }
  return std::nullopt;
}

std::string RosPeer::next(const std::string& beginning) {
  const Deadline deadline = in_time();
  while (true) {
    if (auto line = try_next(beginning)) return *std::move(line);
    if (Clock::now() > deadline || !process_->runs()) {
      throw std::runtime_error("the peer printed no line '" + beginning + "': " + process_->err());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

std::vector<ReceivedTransform> parse_tf(const std::string& line) {
  std::istringstream text(line);
  std::vector<ReceivedTransform> transforms;
  std::int64_t stamp = 0;
  while (text >> stamp) {
    ReceivedTransform one;
    one.stamp = time_of(stamp);
    double numbers[7];
    text >> one.parent >> one.child;
    for (double& number : numbers) text >> number;
    one.X_PC = *Pose::create(Eigen::Quaterniond(numbers[6], numbers[3], numbers[4], numbers[5]),
                             Eigen::Vector3d(numbers[0], numbers[1], numbers[2]));
    transforms.push_back(std::move(one));
  }
  return transforms;
}

std::string tf_message(Time stamp, const std::vector<RosTransform>& transforms) {
  std::ostringstream text;
  text.precision(17);
  text << nanoseconds(stamp);
  for (const RosTransform& one : transforms) {
    const Eigen::Vector3d p = one.X_PC.translation();
    const Eigen::Quaterniond q = one.X_PC.rotation();
    text << ' ' << one.parent << ' ' << one.child;
    for (const double number : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}) {
      text << ' ' << number;
    }
  }
  return text.str();
}

// Of a low domain: the ports of others are those that the kernel gives to any socket, and Cyclone
// DDS does not start if one is taken.
RosRig::RosRig() {
  constexpr std::uint32_t kLow = 100;
  std::vector<std::unique_ptr<DomainLease>> high;
  do {
    if (ros_ != nullptr) high.push_back(std::move(ros_));
    ros_ = std::make_unique<DomainLease>();
  } while (ros_->number() >= kLow);
}

Process RosRig::start_bridge(std::uint32_t dude, const std::vector<std::string>& arguments) const {
  std::vector<std::string> command{"/usr/bin/env",
                                   "ROS_LOCALHOST_ONLY=1",
                                   "ROS_DOMAIN_ID=" + std::to_string(ros_domain()),
                                   TFDUDE_ROS,
                                   "--domain",
                                   std::to_string(dude),
                                   "--local"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  Process bridge(command);
  await_ready(bridge);
  return bridge;
}

}  // namespace tfdude::testing
