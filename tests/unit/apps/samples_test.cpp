#include "tfdude/samples.hpp"

#include <cmath>

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

using testing::Approx;
using testing::ContainsSubstring;

// The only sample that a line holds.
Sample read(SampleReader& reader, const std::string& line) {
  const auto sample = reader.read(line);
  REQUIRE(sample);
  REQUIRE(*sample);
  return **sample;
}

std::string refusal(SampleReader& reader, const std::string& line) {
  const auto sample = reader.read(line);
  return sample ? "accepted" : sample.error().message;
}

SampleReader in_degrees() {
  JointInfo hinge;
  hinge.name = "hinge";
  JointInfo rail;
  rail.name = "rail";
  rail.type = JointType::kPrismatic;
  return SampleReader(kDegree, {{"hinge", hinge}, {"rail", rail}});
}

TEST_CASE("samples: a line of JSON is an edge, edges, or joints") {
  SampleReader reader(kRadian);
  const Sample edge =
      read(reader, R"({"edge": "tool", "xyz": [1, 2, 3], "rpy": [0, 0, 1], "stddev": [1, 1, 1, )"
                   R"(0.1, 0.1, 0.1], "stamp": 12.5})");
  REQUIRE(edge.edges.size() == 1);
  CHECK(edge.edges[0].id == "tool");
  CHECK(edge.edges[0].X_PC.pose.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(edge.edges[0].X_PC.covariance.complete());
  CHECK(edge.stamp == time_of(12'500'000'000));
  const Sample both = read(
      reader, R"({"edges": [{"edge": "a", "xyz": [0, 0, 1]}, {"edge": "b", "quat": [0, 0, 0, 1]}],)"
              R"( "joints": {"elbow": 0.5, "wrist": -1}, "stddev": 0.1, "stamp_ns": 7})");
  CHECK(both.edges.size() == 2);
  CHECK_FALSE(both.edges[0].X_PC.covariance.complete());
  REQUIRE(both.joints.size() == 2);
  CHECK(both.joints[1].name == "wrist");
  CHECK(both.joints[1].position == -1);
  CHECK(both.joints[1].variance == Approx(0.01));
  CHECK(both.stamp == time_of(7));
  CHECK_FALSE(read(reader, R"({"joints": {"elbow": 1}})").stamp);
  CHECK(reader.read("  \r").value() == std::nullopt);
}

TEST_CASE("samples: wrong lines of JSON are named and the next one is read") {
  SampleReader reader(kRadian);
  (void)read(reader, R"({"joints": {"elbow": 1}})");
  const std::pair<const char*, const char*> wrong[] = {
      {"{", "not an object of JSON"},
      {R"({"edge": "a", "xyz": [0, 0, 1]} b)", "not an object of JSON"},
      {R"({"edge": "a", "edge": "b", "xyz": [0, 0, 1]})", "key 'edge' is given twice"},
      {R"({"edge": "a", "xyz": [0, 0, 1], "xyz": [0, 0, 2]})", "key 'xyz' is given twice"},
      {R"({"joints": {"elbow": 1, "elbow": 2}})", "key 'elbow' is given twice"},
      {R"({"edges": [{"edge": "a", "xyz": [0, 0, 1]}, {"edge": "a", "xyz": [0, 0, 2]}]})",
       "edge 'a' is given twice"},
      {R"({"edges": [{"edge": "a", "xyz": [0, 0, 1], "stamp": 1}]})",
       "edge 'a': the stamp stands beside"},
      {R"({"joints": {"elbow": 1}, "stamp": 1, "stamp_ns": 1})", "both given"},
      {"[1]", "not an object of JSON"},
      {"{}", "neither an edge nor a joint"},
      {R"({"edge": 3, "xyz": [0, 0, 0]})", "an edge needs its frame"},
      {R"({"edge": "a"})", "edge 'a' has no pose"},
      {R"({"edge": "a", "xyz": [0, 0]})", "edge 'a': xyz is not an array of 3 numbers"},
      {R"({"edge": "a", "xyz": [0, 0, "1"]})", "xyz is not an array of 3 numbers"},
      {R"({"edge": "a", "xyz": [0, 0, 0], "rpz": [0, 0, 0]})", "edge 'a': key 'rpz' is not known"},
      {R"({"edge": "a", "quat": [0, 0, 0, 2]})", "edge 'a': rotation has the norm 2"},
      {R"({"edge": "a", "xyz": [0, 0, 0], "covariance": "none"})", "unspecified or exact"},
      {R"({"joints": {"elbow": "1"}})", "joint 'elbow': the position is not a number"},
      {R"({"joints": {"elbow": 1}, "stddev": -1})", "stddev is negative"},
      {R"({"joint": {"elbow": 1}})", "key 'joint' is not known"},
      {R"({"joints": [1]})", "joints is not an object"},
      {R"({"joints": {"elbow": 1}, "stamp": "now"})", "stamp is not a number"},
      {R"({"joints": {"elbow": 1}, "stamp": -1})", "stamp is not within"},
      {R"({"joints": {"elbow": 1}, "stamp_ns": 1.5})", "stamp_ns is not a whole number"}};
  for (const auto& [line, message] : wrong) {
    INFO(line);
    CHECK_THAT(refusal(reader, line), ContainsSubstring(message));
  }
  CHECK(read(reader, R"({"joints": {"elbow": 2}})").joints[0].position == 2);
}

TEST_CASE("samples: CSV has joints in columns, or one edge in each line") {
  SampleReader joints(kRadian);
  CHECK(joints.read("stamp, elbow,wrist").value() == std::nullopt);
  const Sample row = read(joints, "1.5,0.25, -1e-3\r");
  REQUIRE(row.joints.size() == 2);
  CHECK(row.joints[1].name == "wrist");
  CHECK(row.joints[1].position == -1e-3);
  CHECK(row.stamp == time_of(1'500'000'000));
  CHECK(refusal(joints, "1,2") == "2 values for 3 columns");
  CHECK(refusal(joints, "1,,3") == "elbow: '' is not a number");
  SampleReader edges(kRadian);
  CHECK(edges.read("edge,x,y,z,qx,qy,qz,qw,stamp_ns").value() == std::nullopt);
  const Sample edge = read(edges, "tool,1,2,3,0,0,0,1,1795000000123456789");
  REQUIRE(edge.edges.size() == 1);
  CHECK(edge.edges[0].X_PC.pose.translation().z() == 3);
  CHECK(edge.stamp == time_of(1'795'000'000'123'456'789));
  CHECK_THAT(refusal(edges, "tool,1,2,3,0,0,0,1,1e9"), ContainsSubstring("whole number"));
  CHECK_THAT(refusal(edges, "tool,1,2,3,0,0,0,2,5"), ContainsSubstring("edge 'tool'"));
}

TEST_CASE("samples: a stamp in CSV is exact to the nanosecond") {
  SampleReader reader(kRadian);
  CHECK(reader.read("stamp,elbow").value() == std::nullopt);
  for (const std::int64_t ns : {1'795'000'000'123'456'789, 1'795'000'000'000'000'001}) {
    std::string digits = std::to_string(ns);
    digits.insert(digits.size() - 9, ".");
    CHECK(read(reader, digits + ",0.5").stamp == time_of(ns));
  }
}

TEST_CASE("samples: wrong names of CSV columns are named") {
  const std::pair<const char*, const char*> wrong[] = {
      {"elbow,elbow", "column 'elbow' is given twice"},
      {"elbow,,wrist", "column 2 has no name"},
      {"edge,x,y", "of the columns x to z some are missing"},
      {"edge,x,y,z,speed", "column 'speed' is not known"},
      {"edge,stamp", "no column of a pose"},
      {"stamp,elbow,stamp_ns", "both given"},
      {"[1,2]", "'[1' is no name of a column"},
      {"\"a\": 1", "is no name of a column"},
      {"0.5,0.25", "'0.5' is no name of a column"},
      {"\x01\x02", "holds a control character"},
      {"\xff\xfe", "is not valid UTF-8"}};
  for (const auto& [line, message] : wrong) {
    INFO(line);
    SampleReader reader(kRadian);
    CHECK_THAT(refusal(reader, line), ContainsSubstring(message));
    CHECK(reader.finish());
    // No later line is taken for names, and what is JSON is read.
    CHECK(refusal(reader, "elbow,wrist") == "the names of the columns were wrong");
    CHECK(refusal(reader, "0.5") == "the names of the columns were wrong");
    CHECK(read(reader, R"({"joints": {"elbow": 1}})").joints.size() == 1);
    CHECK(refusal(reader, "elbow,wrist") == "not an object of JSON");
  }
}

TEST_CASE("samples: names without values are an error at the end") {
  SampleReader reader(kRadian);
  CHECK(reader.finish());
  CHECK(reader.read("this is garbage").value() == std::nullopt);
  CHECK(reader.read(" ").value() == std::nullopt);
  const auto ended = reader.finish();
  REQUIRE_FALSE(ended);
  CHECK_THAT(ended.error().message, ContainsSubstring("no row follows the names of the columns"));
  CHECK(read(reader, "0.5").joints[0].name == "this is garbage");
  CHECK(reader.finish());
}

TEST_CASE("samples: degrees are converted where a number is an angle") {
  const double pi = std::acos(-1.0);
  SampleReader reader = in_degrees();
  const Sample joints = read(reader, R"({"joints": {"hinge": 180, "rail": 180}, "stddev": 18})");
  CHECK(joints.joints[0].position == Approx(pi));
  CHECK(joints.joints[0].variance == Approx(pi * pi / 100));
  CHECK(joints.joints[1].position == 180);
  const Sample edge = read(reader, R"({"edge": "a", "rpy": [0, 0, 90]})");
  CHECK(to_rpy(edge.edges[0].X_PC.pose.rotation()).z() == Approx(pi / 2));
  CHECK_THAT(refusal(reader, R"({"joints": {"other": 1}})"),
             ContainsSubstring("no joint 'other': its unit is not known"));
  SampleReader rows = in_degrees();
  CHECK(rows.read("hinge,rail").value() == std::nullopt);
  CHECK(read(rows, "90,2").joints[0].position == Approx(pi / 2));
}

}  // namespace
}  // namespace tfdude::cli
