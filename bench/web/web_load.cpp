// A robot for pictures and figures of tfdude-web: a partition with a tree of frames, some of which
// move. Prints "ready", and runs until it is stopped.
//
//   web_load --partition NAME --parent FRAME --frames N --moving M --rate HZ --spread METRES

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/node.hpp"

namespace {

using namespace tfdude;

struct Arguments {
  std::string partition = "robot";
  std::string parent;
  int frames = 100;
  int moving = 0;
  double rate = 100;    // [Hz]
  double spread = 0.1;  // of each edge [m]
};

Arguments read(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--partition") arguments.partition = argv[i + 1];
    if (name == "--parent") arguments.parent = argv[i + 1];
    if (name == "--frames") arguments.frames = std::atoi(argv[i + 1]);
    if (name == "--moving") arguments.moving = std::atoi(argv[i + 1]);
    if (name == "--rate") arguments.rate = std::atof(argv[i + 1]);
    if (name == "--spread") arguments.spread = std::atof(argv[i + 1]);
  }
  return arguments;
}

std::string id_of(const Arguments& arguments, int i) {
  return arguments.partition + "_" + std::to_string(i);
}

// Frame i at a time [s]: twigs that sway, with deviations that differ by two orders of magnitude.
Transform value_of(const Arguments& arguments, int i, double t) {
  const double turn = 2.4 * i;
  const double length = arguments.spread * (1 + 0.5 * std::sin(1.7 * i));
  const double sway = 0.15 * std::sin(t + 0.3 * i);
  const Eigen::Quaterniond q = from_rpy(0.25 * std::sin(turn) + sway, 0.25 * std::cos(turn), turn);
  const Eigen::Vector3d p(0.5 * length * std::cos(turn), 0.5 * length * std::sin(turn), length);
  const double s = arguments.spread * 0.01 * std::pow(10.0, std::sin(0.9 * i));
  const auto sigma = Covariance::from_stddev({s, 0.3 * s, 0.6 * s, 0.004, 0.002, 0.006});
  return {Pose::trusted(q, p), i % 23 == 7 ? StatedCovariance::unspecified() : *sigma};
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = read(argc, argv);
  std::vector<FrameSpec> frames;
  for (int i = 0; i < arguments.frames; ++i) {
    const std::string parent = i == 0 ? arguments.parent : id_of(arguments, (i - 1) / 3);
    frames.push_back({id_of(arguments, i), parent, value_of(arguments, i, 0)});
  }
  auto node = Node::open(arguments.partition, frames, Options{});
  if (!node) {
    std::fprintf(stderr, "web_load: %s\n", node.error().message.c_str());
    return 1;
  }
  std::puts("ready");
  std::fflush(stdout);
  const auto begin = std::chrono::steady_clock::now();
  const auto period = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / arguments.rate));
  for (auto next = begin;; next += period) {
    std::this_thread::sleep_until(next);
    const std::chrono::duration<double> t = std::chrono::steady_clock::now() - begin;
    std::vector<EdgeUpdate> updates;
    for (int i = arguments.frames - arguments.moving; i < arguments.frames; ++i) {
      updates.push_back({id_of(arguments, i), value_of(arguments, i, t.count())});
    }
    if (updates.empty()) continue;
    const auto now = std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
    if (const auto updated = node->update(updates, now); !updated) {
      std::fprintf(stderr, "web_load: %s\n", updated.error().message.c_str());
    }
  }
}
