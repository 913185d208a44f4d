// What messages can say and this version does not support yet, and numbers that are missing.

#include <string>

#include "support/catch.hpp"
#include "support/samples.hpp"

namespace tfdude::fastdds {
namespace {

template <class Type, class Sample>
Sample travelled(const Sample& sample) {
  Sample arrived;
  REQUIRE(testing::deserialized<Type>(testing::serialized<Type>(sample), arrived));
  return arrived;
}

TEST_CASE("an unspecified covariance takes no bytes and is rejected by name") {
  wire::Update update = to_wire(Update{{{"hand", {}}}});
  const auto whole = testing::serialized<UpdateType>(update).size();
  update.edges()[0].x_pc().resize(7);
  CHECK(testing::serialized<UpdateType>(update).size() == whole - 21 * sizeof(double));
  const auto read = from_wire(travelled<UpdateType>(update), [](std::string_view) { return true; });
  REQUIRE_FALSE(read);
  CHECK(read.error().code == Errc::kUnsupported);
  CHECK(read.error().message ==
        "frame 'hand': its covariance is unspecified, which this version does not support");

  wire::Joints joints = to_wire(JointUpdate{{{"elbow", 0.5, 1e-4}}});
  const auto both = testing::serialized<JointsType>(joints).size();
  joints.positions()[0].numbers().resize(1);
  CHECK(testing::serialized<JointsType>(joints).size() == both - sizeof(double));
  const auto position =
      from_wire(travelled<JointsType>(joints), [](std::string_view) { return true; });
  REQUIRE_FALSE(position);
  CHECK(position.error().code == Errc::kUnsupported);
  CHECK(position.error().message.find("joint 'elbow': its variance is unspecified") == 0);
}

TEST_CASE("a transform has 7 or 28 numbers and a position 1 or 2") {
  for (const std::size_t count : {0U, 6U, 8U, 27U}) {
    wire::Update update = to_wire(Update{{{"hand", {}}}});
    update.edges()[0].x_pc().resize(count);
    const auto read = from_wire(update, [](std::string_view) { return true; });
    REQUIRE_FALSE(read);
    CHECK(read.error().message ==
          "frame 'hand': a transform of " + std::to_string(count) + " numbers");
  }
  wire::Joints joints = to_wire(JointUpdate{{{"elbow", 0.5, 1e-4}}});
  joints.positions()[0].numbers().clear();
  const auto read = from_wire(joints, [](std::string_view) { return true; });
  REQUIRE_FALSE(read);
  CHECK(read.error().message == "joint 'elbow' without a position");
}

TEST_CASE("no stamp differs from a stamp of zero") {
  const auto stamp_of = [](std::int64_t stamp) {
    wire::Update update = to_wire(Update{{{"hand", {}}}});
    update.stamp(stamp);
    return from_wire(travelled<UpdateType>(update), [](std::string_view) { return true; });
  };
  CHECK(stamp_of(-1)->stamp == std::nullopt);
  CHECK(stamp_of(0)->stamp == time_of(0));
  CHECK(stamp_of(INT64_MAX)->stamp == time_of(INT64_MAX));
  for (const std::int64_t bad : {std::int64_t{-2}, INT64_MIN}) {
    const auto read = stamp_of(bad);
    REQUIRE_FALSE(read);
    CHECK(read.error().message ==
          "the stamp of an update of " + std::to_string(bad) + " ns is negative");
  }
}

}  // namespace
}  // namespace tfdude::fastdds
