#include <cstdio>
#include <cstdlib>

#include <tfdude/client/node.hpp>
#include <tfdude/transport/loopback.hpp>

// A node that owns two frames and a client that asks for them, in one process: everything that is
// installed is linked, and no network is needed.
int main() {
  const auto covariance = tfdude::Covariance::from_stddev({0.3, 0, 0, 0, 0, 0});
  const auto pose = tfdude::Pose::create(Eigen::Quaterniond::Identity(), {1, 0, 0});
  if (!covariance || !pose) return EXIT_FAILURE;
  const tfdude::Transform X{*pose, *covariance};

  tfdude::LoopbackNetwork network;
  const auto node =
      tfdude::Node::open(network.join(), "arm", {{"base", "", X}, {"hand", "base", X}});
  auto client = tfdude::Client::open(network.join());
  if (!node || !client) return EXIT_FAILURE;
  if (const auto added = client->add("tip", "hand", X); !added) {
    std::fprintf(stderr, "%s\n", added.error().message.c_str());
    return EXIT_FAILURE;
  }
  const auto X_BT = client->lookup("base", "tip");
  if (!X_BT) return EXIT_FAILURE;
  const double x = X_BT->pose.translation().x();
  const double variance = X_BT->covariance.of_specified().upper()[0];
  std::printf("x = %g m, variance = %g m2\n", x, variance);
  const bool right = x == 2.0 && variance > 0.1799 && variance < 0.1801;
  // Over DDS the same calls are made; joining a domain that does not exist is enough to link it.
  tfdude::Options nowhere;
  nowhere.domain = 233;
  return right && !tfdude::Client::open(nowhere) ? EXIT_SUCCESS : EXIT_FAILURE;
}
