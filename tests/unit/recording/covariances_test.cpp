// Covariances that a recording does not repeat.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "recording/messages.hpp"
#include "recording/recorder.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude::recording {
namespace {

using testing::along_x;

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9 + 0.5)); }

StatedCovariance stddev(double sigma) {
  return Covariance::from_stddev({sigma, sigma, sigma, sigma, sigma, sigma}).value();
}

WatchedValue sample(double seconds, const StatedCovariance& covariance) {
  return {1, at(seconds), {along_x(seconds).pose, covariance}};
}

// The variance of each value in the messages, from one of them on, that is not repeated.
std::vector<std::optional<double>> variances(const std::vector<std::string>& messages,
                                             std::size_t from) {
  EdgeTable edges;
  ValuesDecoder decoder(edges);
  std::vector<std::optional<double>> found;
  for (std::size_t i = from; i < messages.size(); ++i) {
    RecordedValues values;
    REQUIRE(decoder.decode(messages[i], values));
    for (const RecordedValue& value : values.values) {
      if (values.repeats) continue;
      const Covariance* covariance = value.X_PC.covariance.if_complete();
      found.push_back(covariance != nullptr ? std::optional(covariance->upper()[0]) : std::nullopt);
    }
  }
  return found;
}

TEST_CASE("recording: after a keyframe a covariance is told again that it did not have") {
  std::vector<std::string> messages;
  Recorder recorder([&](const Recorder::Record& record) -> Result<void> {
    if (record.topic == Topic::kValues) messages.emplace_back(record.data);
    return {};
  });
  const auto add = [&](const WatchedValue& value) {
    REQUIRE(recorder.add({"slam", ValuesNews{messages.size() + 1, {value}}}, *value.stamp));
  };
  REQUIRE(recorder.add({"slam", FramesNews{{{"map", ""}, {"robot", "map"}}, 7}}, at(0)));
  add(sample(1, stddev(0.5)));
  add(sample(2, StatedCovariance::unspecified()));
  const std::size_t keyframe = messages.size();
  REQUIRE(recorder.keyframe(at(2)));
  add(sample(3, stddev(0.5)));
  add(sample(4, stddev(0.5)));
  // The last one does not repeat it.
  CHECK(messages.back().size() < messages[messages.size() - 2].size());
  CHECK(variances(messages, keyframe) == std::vector<std::optional<double>>{0.25, 0.25});
  CHECK(variances(messages, 0) ==
        std::vector<std::optional<double>>{0.25, std::nullopt, 0.25, 0.25});
}

// A value with another covariance cannot be taken, and one with "the covariance as before" follows.
TEST_CASE("recording: the covariance of a value that is left out is not that of one before") {
  const WatchedFrame edge{"robot", "map"};
  const auto taken = [&](const WatchedValue& left_out) {
    std::string message;
    ValuesEncoder encoder(message, "slam", 1, false);
    encoder.add(edge, sample(1, stddev(0.5)), false);
    encoder.add(edge, left_out, false);
    encoder.add(edge, sample(3, stddev(2)), true);
    encoder.add(edge, sample(4, stddev(2)), false);
    encoder.add(edge, sample(5, stddev(2)), true);
    encoder.finish();
    return variances({message}, 0);
  };
  const std::vector<std::optional<double>> expected{0.25, 4, 4};
  WatchedValue late = sample(2, stddev(2));
  late.stamp = time_of(kMaxTime + 1);
  CHECK(taken(late) == expected);
  WatchedValue nameless = sample(2, stddev(2));
  nameless.correlation.common_errors.push_back({"", false, Loading::Zero(6, 1)});
  CHECK(taken(nameless) == expected);
  WatchedValue begins = sample(2, stddev(2));
  Covariance::Upper noise{};
  noise[0] = -1;
  begins.begins = Covariance::trusted(noise);
  CHECK(taken(begins) == expected);
  WatchedValue unclear = sample(2, stddev(2));
  Covariance::Upper unknown{};
  unknown[0] = std::numeric_limits<double>::quiet_NaN();
  unclear.X_PC.covariance = Covariance::trusted(unknown);
  CHECK(taken(unclear) == expected);
  CHECK(taken(sample(2, stddev(1))) == std::vector<std::optional<double>>{0.25, 1, 1, 4, 4});
}

}  // namespace
}  // namespace tfdude::recording
