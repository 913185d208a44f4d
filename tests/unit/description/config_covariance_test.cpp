// Covariances that a configuration leaves out, or gives by a word.

#include <string>

#include "tfdude/description/config.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "support/catch.hpp"

namespace tfdude {
namespace {

Result<Config> parsed(const std::string& text) { return parse_config(text, "robot.yaml"); }

std::string message_of(const std::string& text) {
  const auto config = parsed(text);
  return config ? "ok" : config.error().message;
}

const StatedCovariance kNothing = StatedCovariance::unspecified();

}  // namespace

TEST_CASE("a frame says that its covariance is unspecified or exact") {
  const auto config = parsed(
      "frames:\n"
      "  - {id: odom, covariance: unspecified}\n"
      "  - {id: base, covariance: exact}\n"
      "  - {id: arm, stddev: [1, 1, 1, 1, 1, 1]}\n");
  REQUIRE(config);
  CHECK(config->frames[0].X_PC.covariance == kNothing);
  CHECK(config->frames[1].X_PC.covariance == StatedCovariance::exact());
  CHECK(config->frames[2].X_PC.covariance.complete());
  CHECK(message_of("frames:\n  - id: odom\n    covariance: none\n") ==
        "robot.yaml:3: frame 'odom': covariance must be unspecified or exact");
  CHECK(message_of("frames:\n  - id: odom\n    covariance: [1]\n") ==
        "robot.yaml:3: frame 'odom': covariance is not text");
  CHECK(message_of("frames:\n  - id: odom\n    stddev: [1, 1, 1, 1, 1, 1]\n"
                   "    covariance: exact\n") ==
        "robot.yaml:3: frame 'odom': stddev and covariance are both given, one is enough");
}

TEST_CASE("a file gives the covariance of frames without their own") {
  for (const bool exact : {true, false}) {
    const auto config = parsed(std::string("covariance: ") + (exact ? "exact" : "unspecified") +
                               "\nframes:\n"
                               "  - {id: odom}\n"
                               "  - {id: base, covariance: exact}\n"
                               "  - {id: arm, covariance: unspecified}\n"
                               "  - {id: hand, stddev: [1, 1, 1, 1, 1, 1]}\n");
    REQUIRE(config);
    CHECK(config->frames[0].X_PC.covariance.complete() == exact);
    CHECK(config->frames[1].X_PC.covariance.complete());
    CHECK_FALSE(config->frames[2].X_PC.covariance.complete());
    CHECK(config->frames[3].X_PC.covariance.complete());
  }
  CHECK(message_of("partition: a\ncovariance: zero\n") ==
        "robot.yaml:2: covariance must be unspecified or exact");
}

TEST_CASE("a frame without a covariance is unspecified") {
  const auto config = parsed("frames:\n  - {id: odom, parent: map, xyz: [1, 0, 0]}\n");
  REQUIRE(config);
  CHECK(config->frames[0].X_PC.covariance == kNothing);
}

TEST_CASE("a file gives the covariance of a robot's joints that do not move") {
  const std::string urdf = TFDUDE_FIXTURES "/format_2/robot.urdf";
  const auto check_fixed = [&](const std::string& head, bool complete) {
    const auto config = parsed(head + "urdf:\n  - file: " + urdf + "\n    root: world\n");
    INFO((config ? "" : config.error().message));
    REQUIRE(config);
    int fixed = 0;
    for (const FrameSpec& frame : config->frames) {
      if (frame.joint) {
        CHECK_FALSE(frame.X_PC.covariance.complete());  // its position has no sample
        continue;
      }
      ++fixed;
      CHECK(frame.X_PC.covariance.complete() == complete);
    }
    CHECK(fixed > 0);
  };
  check_fixed("covariance: exact\n", true);
  check_fixed("covariance: unspecified\n", false);
  check_fixed("", false);
}

}  // namespace tfdude
