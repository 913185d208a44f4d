// The calls that bench/python.py makes from Python, in C++: lookups over 30 own edges, lookups of
// the same frames from their owner over DDS, and joints streamed to that owner. Reads from standard
// input how many of which calls to make, such as "own 1000", and writes the median time [us].

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

namespace {

using namespace tfdude;

constexpr int kJoints = 30;

template <class T>
T must(Result<T> result) {
  if (result) return *std::move(result);
  std::cerr << result.error().message << "\n";
  std::exit(1);
}

std::vector<std::string> joint_names() {
  std::vector<std::string> names;
  for (int i = 0; i < kJoints; ++i) names.push_back("joint" + std::to_string(i));
  return names;
}

/// As in bench/python.py.
std::vector<FrameSpec> robot() {
  std::vector<FrameSpec> frames{{"link0", "", Transform::exact({}), {}, {}, {}}};
  for (const std::string& name : joint_names()) {
    JointSpec joint;
    joint.name = name;
    const Pose up = must(Pose::create(Eigen::Quaterniond::Identity(), {0, 0, 0.1}));
    joint.joint = revolute_joint(Transform::exact(up), Eigen::Vector3d::UnitZ());
    joint.variance = 1e-6;
    FrameSpec frame;
    frame.id = "link" + std::to_string(frames.size());
    frame.parent = frames.back().id;
    frame.X_PC = value_at(joint, 0, joint.variance);
    frame.joint = joint;
    frames.push_back(frame);
  }
  return frames;
}

template <class Call>
double median_us(int count, const Call& call) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    call();
    times.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin)
            .count());
  }
  std::nth_element(times.begin(), times.begin() + count / 2, times.end());
  return times[static_cast<std::size_t>(count) / 2];
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  Options options;
  options.domain = static_cast<std::uint32_t>(std::atoi(argv[1]));
  options.profile = kLocalProfile;
  LoopbackNetwork network;
  Node own = must(Node::open(network.join(), "own", robot()));
  Client client = must(Client::open(options));
  static_cast<void>(must(client.lookup("link0", "link30", {}, Milliseconds(10000))));
  JointStream stream = must(client.stream_joints(joint_names()));
  std::vector<double> positions(kJoints);
  const std::vector<double> variances(kJoints, 1e-6);
  std::string what;
  for (int count = 0; std::cin >> what >> count;) {
    double us = 0;
    if (what == "own") {
      us = median_us(count,
                     [&] { static_cast<void>(must(own.lookup("link0", "link30", Query{}))); });
    } else if (what == "remote") {
      us = median_us(count,
                     [&] { static_cast<void>(must(client.lookup("link0", "link30", Query{}))); });
    } else {
      us = median_us(count, [&] {
        positions[0] += 1e-6;
        static_cast<void>(stream.try_publish(positions, variances));
      });
    }
    std::cout << us << std::endl;
  }
}
