// What decides in tfdude-web, without a network: who may connect, what clients may ask for, what is
// kept of the values, and the layout of the messages.

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "tfdude-web/meshes.hpp"
#include "tfdude-web/request.hpp"
#include "tfdude-web/site.hpp"
#include "tfdude-web/world.hpp"

namespace tfdude::web {
namespace {

using testing::along_x;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

template <class T>
T read_at(const std::string& bytes, std::size_t place) {
  T value;
  REQUIRE(bytes.size() >= place + sizeof(T));
  std::memcpy(&value, bytes.data() + place, sizeof(T));
  return value;
}

std::uint32_t count_in(const std::string& message) {
  return message.empty() ? 0 : read_at<std::uint32_t>(message, 16);
}

Request from(const std::string& host, const std::string& origin = {}) {
  Request request;
  request.path = "/";
  request.host = host;
  request.origin = origin;
  return request;
}

unsigned status(const Access& access, const Request& request) {
  const auto reply = reject(access, request);
  return reply ? reply->status : 200;
}

WatchedValue value(std::uint32_t frame, double x, std::optional<Time> stamp = std::nullopt) {
  WatchedValue made;
  made.frame = frame;
  made.X_PC = along_x(x);
  made.stamp = stamp;
  return made;
}

// A partition of a base and an arm, with values.
void fill(World& world) {
  world.receive({"arm", ReachNews{true, {}}});
  world.receive({"arm", FramesNews{{{"base", ""}, {"hand", "base"}}, 1}});
}

}  // namespace

TEST_CASE("web: only pages of this server connect, by a name that cannot be forged") {
  const Access local;
  CHECK(status(local, from("localhost:8765")) == 200);
  CHECK(status(local, from("127.0.0.1:9")) == 200);
  CHECK(status(local, from("[::1]:8765")) == 200);
  CHECK(status(local, from("localhost.evil.example")) == 403);
  CHECK(status(local, from("robot:8765")) == 403);
  CHECK(status(local, from("")) == 403);
  CHECK(status(local, from("localhost:8765", "http://localhost:8765")) == 200);
  CHECK(status(local, from("localhost:8765", "http://localhost:1")) == 403);
  CHECK(status(local, from("localhost:8765", "null")) == 403);
  const Access open{true, {}, {"https://app.foxglove.dev"}};
  CHECK(status(open, from("localhost:8765", "https://app.foxglove.dev")) == 200);
  CHECK(status(open, from("localhost:8765", "http://app.foxglove.dev")) == 403);
}

TEST_CASE("web: a token is taken from the address or from the cookie") {
  const Access access{false, "secret", {}};
  Request request = from("robot:8765");
  CHECK(status(access, request) == 401);
  request.query = "a=b&token=secret";
  CHECK(status(access, request) == 200);
  request.query = "token=secre";
  CHECK(status(access, request) == 401);
  request.cookie = "other=1; tfdude_token=secret";
  CHECK(status(access, request) == 200);
  CHECK(choose_protocol("a, foxglove.sdk.v1 ,b", {"b", "foxglove.sdk.v1"}) == "foxglove.sdk.v1");
  CHECK(choose_protocol("", {"b"}).empty());
}

TEST_CASE("web: requests of pages are checked") {
  CHECK(std::holds_alternative<LiveRequest>(parse_request(R"({"op":"live"})").value()));
  CHECK(std::holds_alternative<WhyRequest>(parse_request(R"({"op":"why"})").value()));
  CHECK(std::holds_alternative<RobotRequest>(parse_request(R"({"op":"robot"})").value()));
  CHECK(std::holds_alternative<CancelRequest>(parse_request(R"({"op":"cancel"})").value()));
  const auto upload = parse_request(R"({"op":"upload","bytes":18446744073709551615})");
  REQUIRE(upload);
  CHECK(std::get<UploadRequest>(*upload).bytes == UINT64_MAX);
  const auto pair = parse_request(R"({"op":"pair","a":"world","b":"hand"})");
  REQUIRE(pair);
  CHECK(std::get<PairRequest>(*pair).b == "hand");
  const auto past = parse_request(R"({"op":"past","at":"1700000000000000001"})");
  REQUIRE(past);
  CHECK(nanoseconds(std::get<PastRequest>(*past).at) == 1700000000000000001);
  for (const char* bad :
       {"", "null", R"({"op":"past","at":"-1"})", R"({"op":"past","at":"1e9"})",
        R"({"op":"past","at":"99999999999999999999"})", R"({"op":"pair","a":"world","b":""})",
        R"({"op":"pair","a":"\u0007","b":"x"})", R"({"op":"update"})", R"({"op":5})",
        R"({"op":"upload"})", R"({"op":"upload","bytes":-1})", R"({"op":"upload","bytes":1.5})",
        R"({"op":"upload","bytes":"5"})", R"({"op":"upload","bytes":18446744073709551616})"}) {
    INFO(bad);
    CHECK_FALSE(parse_request(bad));
  }
}

TEST_CASE("web: a page gets what changed since its last picture") {
  World world;
  fill(world);
  world.receive({"arm", ValuesNews{1, {value(1, 2)}}});
  const std::uint64_t first = world.end_picture();
  const std::string all = world.values_since(0, ms(5));
  REQUIRE(count_in(all) == 1);
  CHECK(all.size() == 20 + 26);
  CHECK(read_at<std::uint32_t>(all, 4) == world.structure());
  CHECK(read_at<std::int64_t>(all, 8) == nanoseconds(ms(5)));
  CHECK((read_at<std::uint32_t>(all, 20) & 0x1fffffffU) == 1);
  CHECK(read_at<std::int32_t>(all, 24) == INT32_MIN);
  CHECK(read_at<float>(all, 28) == 2.0F);
  CHECK(world.values_since(first, ms(5)).empty());
  world.receive({"arm", ValuesNews{2, {value(1, 3, ms(4))}}});
  const std::uint64_t second = world.end_picture();
  const std::string changed = world.values_since(first, ms(5));
  CHECK(count_in(changed) == 1);
  CHECK(read_at<std::int32_t>(changed, 24) == -10);  // in 0.1 ms
  CHECK(world.values_since(second, ms(5)).empty());
  // The covariance is the same, so it is not sent again.
  CHECK(world.covariances_since(first, ms(5)).empty());
}

TEST_CASE("web: large coordinates keep their digits") {
  Message message(Kind::kValues, 1, ms(0), false);
  message.add_value(3, Pose::trusted(Eigen::Quaterniond::Identity(), {500000.125, 0, 0}), ms(0));
  const std::string bytes = message.finish();
  CHECK(bytes.size() == 20 + 38);
  CHECK(read_at<double>(bytes, 28) == 500000.125);
}

TEST_CASE("web: an instant of the past is interpolated, and has no value outside of what is kept") {
  World world;
  fill(world);
  world.receive({"arm", ValuesNews{1, {value(1, 0, ms(0)), value(1, 1, ms(100))}}});
  const auto half = world.at(ms(50));
  REQUIRE(count_in(half.at(0)) == 1);
  CHECK(read_at<float>(half[0], 28) == 0.5F);
  CHECK(half[0][1] == 1);  // it says that it is of the past
  CHECK(count_in(world.at(ms(101)).at(0)) == 0);
  CHECK(count_in(world.at(ms(-1)).at(0)) == 0);
  // A new history begins: what was kept does not hold any more.
  WatchedValue again = value(1, 5, ms(10));
  again.begins = Covariance();
  world.receive({"arm", ValuesNews{2, {again}}});
  CHECK(count_in(world.at(ms(50)).at(0)) == 0);
}

TEST_CASE("web: a sample that was corrected is shown as it is now") {
  World world;
  fill(world);
  world.receive({"arm", ValuesNews{1, {value(1, 1, ms(100)), value(1, 3, ms(200))}}});
  world.receive({"arm", ValuesNews{2, {value(1, 2, ms(100))}}});
  CHECK(read_at<float>(world.at(ms(100)).at(0), 28) == 2.0F);
  CHECK(read_at<float>(world.at(ms(150)).at(0), 28) == 2.5F);
  CHECK(read_at<float>(world.values_since(0, ms(300)), 28) == 3.0F);
  world.receive({"arm", ValuesNews{3, {value(1, 4, ms(200))}}});
  CHECK(read_at<float>(world.values_since(0, ms(300)), 28) == 4.0F);
  // Its history is cleared: it has no value until the next sample.
  WatchedValue cleared = value(1, 4);
  cleared.cleared = true;
  world.receive({"arm", ValuesNews{4, {cleared}}});
  CHECK(count_in(world.at(ms(100)).at(0)) == 0);
  CHECK(world.values_since(0, ms(300)).empty());
}

TEST_CASE("web: a frame keeps its value while its partition changes around it") {
  World world;
  fill(world);
  world.receive({"arm", ValuesNews{1, {value(1, 2)}}});
  const std::uint32_t before = world.structure();
  world.receive({"arm", FramesNews{{{"base", ""}, {"finger", "hand"}, {"hand", "base"}}, 1}});
  CHECK(world.structure() != before);
  CHECK(count_in(world.values_since(0, ms(0))) == 1);
  world.receive({"arm", FramesNews{{{"base", ""}, {"hand", ""}}, 1}});  // it is another edge now
  CHECK(count_in(world.values_since(0, ms(0))) == 0);
  world.receive({"arm", ReachNews{false, "lost"}});
  CHECK(world.structure_json().at("partitions").at(0).at("reachable") == false);
  world.drop("arm");
  CHECK(world.structure_json().at("frames").empty());
}

TEST_CASE("web: a correlated edge does not look better known than it is") {
  World world;
  fill(world);
  WatchedValue shared = value(1, 2);
  CommonError error;
  error.source = "supply";
  error.loading = Loading::Zero(6, 1);
  error.loading(0, 0) = 3;
  shared.X_PC.covariance = StatedCovariance::exact();
  shared.correlation.common_errors = {error};
  world.receive({"arm", ValuesNews{1, {shared}}});
  const std::string message = world.covariances_since(0, ms(0));
  REQUIRE(count_in(message) == 1);
  CHECK(read_at<float>(message, 24) == 9.0F);
  CHECK((read_at<std::uint32_t>(message, 20) >> 30U & 1U) == 1);
}

TEST_CASE("web: only meshes that a URDF names are served, and only from below its folders") {
  const testing::TemporaryDirectory outside;
  const testing::TemporaryDirectory folder;
  const std::string packages = folder.path() + "/packages";
  std::filesystem::create_directories(packages + "/arm/meshes");
  const auto write = [](const std::string& file) { std::ofstream(file) << "solid x"; };
  write(packages + "/arm/meshes/link.STL");
  write(packages + "/arm/meshes/unnamed.stl");
  const std::string secret = outside.write("secret.stl", "solid secret");
  std::filesystem::create_symlink(secret, packages + "/arm/meshes/linked.stl");
  const auto link = [](const std::string& file) {
    return "<link name='a'><visual><origin xyz='1 2 3'/><geometry><mesh filename='" + file +
           "' scale='2 2 2'/></geometry></visual></link>";
  };
  const std::string urdf = folder.write(
      "robot.urdf", "<robot name='r'>" + link("package://arm/meshes/link.STL") + link(secret) +
                        link("package://arm/meshes/linked.stl") +
                        link("package://arm/../../../" + secret) + link("package://") +
                        "<link name='b'><visual><origin quat_xyzw='1 0 0 0'/><geometry>"
                        "<sphere radius='0.5'/></geometry></visual></link></robot>");
  Files files;
  const auto left_out = add_meshes(urdf, {packages}, files);
  REQUIRE(left_out);
  CHECK(left_out->size() == 4);
  const auto robot = nlohmann::json::parse(*files.get("/robot.json").body);
  REQUIRE(robot.at("visuals").size() == 2);
  CHECK(robot["visuals"][0]["xyz"] == nlohmann::json({1, 2, 3}));
  CHECK(robot["visuals"][1]["sphere"] == 0.5);
  CHECK(std::abs(robot["visuals"][1]["rpy"][0].get<double>()) == testing::Approx(std::acos(-1.0)));
  CHECK(*files.get(robot["visuals"][0]["mesh"].get<std::string>()).body == "solid x");
  CHECK(files.get("/mesh/1.stl").status == 404);
  CHECK_FALSE(add_meshes(folder.path() + "/none.urdf", {}, files));
}

// Once, 300,000 attributes took minutes.
TEST_CASE("web: a URDF is read within the limits of the daemon, and errors say the line") {
  const testing::TemporaryDirectory folder;
  const auto error_of = [&](const std::string& text) {
    Files files;
    const auto added = add_meshes(folder.write("robot.urdf", text), {}, files);
    return added ? "ok" : added.error().message;
  };
  const std::string file = folder.path() + "/robot.urdf";
  std::string many = "<robot";
  for (int i = 0; i < 300'000; ++i) many += " a" + std::to_string(i) + "=''";
  CHECK(error_of(many + "/>") == file + ":1: an element has more than 256 attributes");
  CHECK(error_of("<robot>\n<link></robot>").rfind(file + ":2: not XML: ", 0) == 0);
  CHECK(error_of("<world/>") == file + ":1: not a URDF: <world> instead of <robot>");
}

}  // namespace tfdude::web
