// Writes seeds: make_seeds FOLDER. One file for each message of tests/support/samples.hpp, choices
// for the harness of partitions, stored states and recordings; those of configurations are written
// by hand.

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <sqlite3.h>
#include <string>

#include "tfdude/recording/recording_writer.hpp"

#include "memory/one_shot.hpp"
#include "recording/messages.hpp"
#include "recording/schemas.hpp"
#include "ros/ros_bytes.hpp"
#include "store/sqlite_store.hpp"
#include "support/samples.hpp"
#include "tfdude-ros/fastdds/convert.hpp"
#include "types/ros_tf.hpp"

namespace tfdude::fuzz {
namespace {

using testing::Bytes;
using testing::Random;

void write(const std::filesystem::path& folder, const std::string& name, const Bytes& bytes) {
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / name, std::ios::binary);
  for (const std::uint8_t byte : bytes) file.put(static_cast<char>(byte));
}

// "reply 3" and "update of 2" as folder and file.
void write_samples(const std::filesystem::path& folder) {
  Random random(0x5eed);
  for (const testing::WireKind& kind : testing::wire_kinds(random)) {
    const std::string topic = kind.name.substr(0, kind.name.find(' '));
    if (topic == "state") continue;  // the harness of that name gets stored states instead
    const std::string rest = kind.name.substr(kind.name.rfind(' ') + 1);
    write(folder / topic, rest, kind.valid);
  }
}

// The first byte is the type.
template <class Generated>
void write_wire(const std::filesystem::path& folder, ros::MessageType type,
                const Generated& message) {
  Bytes bytes = ros::bytes_of(type, message);
  bytes.insert(bytes.begin(), static_cast<std::uint8_t>(type));
  write(folder / "ros", std::to_string(bytes.front()), bytes);
}

template <class Message>
void write_ros(const std::filesystem::path& folder, ros::MessageType type, const Message& message) {
  write_wire(folder, type, ros::generated(message));
}

// Those that are only read.
void write_detections(const std::filesystem::path& folder) {
  using ros::MessageType;
  ros::wire::Detections objects;
  objects.header_().frame_id_("camera");
  objects.detections_().resize(2);
  objects.detections_()[0].results_().resize(1);
  objects.detections_()[0].results_()[0].hypothesis_().class_id_("cup");
  objects.detections_()[0].results_()[0].pose_().pose_().orientation_().w_(1);
  objects.detections_()[1].id_("track 5");
  write_wire(folder, MessageType::kDetection3DArray, objects);
  ros::wire::Tags tags;
  tags.header_().frame_id_("camera");
  tags.detections_().resize(1);
  tags.detections_()[0].family_("36h11");
  tags.detections_()[0].id_(7);
  tags.detections_()[0].pose_().pose_().pose_().orientation_().w_(1);
  write_wire(folder, MessageType::kAprilTagDetectionArray, tags);
  ros::wire::Markers markers;
  markers.header_().frame_id_("camera");
  markers.marker_ids_({5});
  markers.poses_().resize(1);
  markers.poses_()[0].orientation_().w_(1);
  write_wire(folder, MessageType::kArucoMarkers, markers);
}

void write_places(const std::filesystem::path& folder) {
  using ros::MessageType;
  ros::wire::NavSatFix fix;
  fix.header_().frame_id_("gps");
  fix.latitude_(48);
  fix.longitude_(11.5);
  fix.altitude_(519);
  fix.position_covariance_()[0] = fix.position_covariance_()[4] = 1;
  fix.position_covariance_()[8] = 4;
  fix.position_covariance_type_(2);
  write_wire(folder, MessageType::kNavSatFix, fix);
  ros::wire::GeoPose pose;
  pose.header_().frame_id_("map");
  pose.pose_().position_().latitude_(48);
  pose.pose_().orientation_().w_(1);
  write_wire(folder, MessageType::kGeoPoseStamped, pose);
}

void write_ros(const std::filesystem::path& folder) {
  using ros::MessageType;
  const ros::RosPose pose{{1, 2, 3}, {0, 0, 0.6, 0.8}};
  ros::PoseWithCovariance measured{time_of(3), "map", pose, {}};
  measured.covariance[0] = 0.25;
  write_ros(folder, MessageType::kTf,
            ros::TfMessage{{time_of(1), "odom", "base", pose}, {{}, "base", "/imu", pose}});
  write_ros(folder, MessageType::kJointState,
            ros::JointState{time_of(2), {"elbow", "wrist"}, {0.5, -1}});
  write_ros(folder, MessageType::kString, ros::Text{"<robot/>"});
  write_ros(folder, MessageType::kPoseWithCovarianceStamped, measured);
  write_ros(folder, MessageType::kOdometry, ros::Odometry{measured, "base", {1, 0, 0}, {}, {}});
  write_ros(folder, MessageType::kClock, ros::ClockTime{time_of(4)});
  write_detections(folder);
  write_places(folder);
}

void write_choices(const std::filesystem::path& folder) {
  Random random(0xc401ce);
  for (const std::size_t size : {16U, 64U, 256U, 1024U}) {
    Bytes bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
    write(folder / "partition", std::to_string(size), bytes);
  }
}

Bytes content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::unique_ptr<StateStore> opened(const std::filesystem::path& file) {
  auto store = open_sqlite_store(file, "arms");
  if (!store) std::fprintf(stderr, "%s\n", store.error().message.c_str());
  return store ? *std::move(store) : nullptr;
}

// Pages as small as they can be, so that a file is.
bool shrink(const std::filesystem::path& file) {
  sqlite3* database = nullptr;
  sqlite3_open(file.c_str(), &database);
  const int status = sqlite3_exec(database,
                                  "PRAGMA journal_mode = DELETE; PRAGMA page_size = 512; VACUUM;"
                                  "PRAGMA journal_mode = WAL;",
                                  nullptr, nullptr, nullptr);
  sqlite3_close(database);
  return status == SQLITE_OK;
}

// The first byte says what follows: a file; or two bytes with the length of its log, the file and
// the log.
Bytes state_of(std::uint8_t kind, const std::filesystem::path& file) {
  Bytes bytes = content(file);
  if (kind == 1) {
    const Bytes log = content(file.string() + "-wal");
    bytes.insert(bytes.end(), log.begin(), log.end());
    bytes.insert(bytes.begin(), {static_cast<std::uint8_t>(log.size() / 256),
                                 static_cast<std::uint8_t>(log.size() % 256)});
  }
  bytes.insert(bytes.begin(), kind);
  return bytes;
}

bool write_states(const std::filesystem::path& folder) {
  Random random(0x57a7e);
  const auto file = std::filesystem::temp_directory_path() / "tfdude-seed.sqlite";
  std::filesystem::remove(file);
  opened(file).reset();
  if (!shrink(file)) return false;
  write(folder / "state", "empty", state_of(0, file));
  const StateChange change{7,
                           {"hand", "arm", "lamp"},
                           {{"arm", "", random.transform(), 5}, {"hand", "arm", {}, 6}},
                           {{"lamp", 7, Tombstone::Kind::kYielded, "head"}},
                           {{"elbow", 0.5, 1e-4}}};
  {
    const auto store = opened(file);
    if (!store || !store->save(change)) return false;
    write(folder / "state", "log", state_of(1, file));
    StateChange configuration{7};
    configuration.configured = std::vector<FrameSpec>{{"arm", "", {}}};
    if (!store->save(configuration)) return false;
  }
  write(folder / "state", "full", state_of(0, file));
  std::filesystem::remove(file);
  Bytes choices(200);
  for (std::uint8_t& byte : choices) byte = static_cast<std::uint8_t>(random.index(256));
  choices[0] = 3;
  write(folder / "state", "rows", choices);
  return true;
}

// Choices of the harness: messages of a partition, and transforms of ROS.
void write_messages(const std::filesystem::path& folder) {
  using namespace recording;
  Random random(0x7f);
  std::string message;
  const auto add = [&](Bytes& choices, Topic topic) {
    choices.push_back(static_cast<std::uint8_t>(topic));
    choices.push_back(static_cast<std::uint8_t>(choices.size() % 100));
    choices.push_back(static_cast<std::uint8_t>(message.size() / 256));
    choices.push_back(static_cast<std::uint8_t>(message.size() % 256));
    choices.insert(choices.end(), message.begin(), message.end());
  };
  Bytes ours{0};
  const WatchedFrame hand{"hand", "arm"};
  encode(RecordedFrames{"arms", 1, true, "", true, false, {{"arm", ""}, hand}, {}}, message);
  add(ours, Topic::kFrames);
  for (int i = 0; i < 3; ++i) {
    ValuesEncoder encoder(message, "arms", 1, false);
    WatchedValue value{1, time_of(i), random.transform(), {}, Covariance()};
    if (i > 0) value.begins.reset();
    encoder.add(hand, value, i == 2);
    encoder.finish();
    add(ours, Topic::kValues);
  }
  encode(Change{ChangeKind::kPartitionUp, "arms"}, message);
  add(ours, Topic::kEvents);
  write(folder / "recording", "messages", ours);
  Bytes ros{1};
  for (const Topic topic : {Topic::kTf, Topic::kTfStatic}) {
    ros::TfEncoder encoder(message);
    encoder.add("odom", topic == Topic::kTf ? "base" : "camera", random.pose(), time_of(5));
    encoder.finish();
    add(ros, topic);
  }
  write(folder / "recording", "ros", ros);
}

void write_one_shots(const std::filesystem::path& folder) {
  const auto add = [&](const char* name, const auto& message) {
    const std::string text = one_shot_message(message);
    write(folder / "one_shot", name, Bytes(text.begin(), text.end()));
  };
  add("newest", OneShotQuestion{"a", "b", {}});
  add("question", OneShotQuestion{"world", "hand left", time_of(5)});
  OneShotAnswer answer;
  add("nothing", answer);
  answer.X_AB.stamp = time_of(5);
  answer.X_AB.covariance = StatedCovariance::exact();
  answer.X_AB.basis.sources = {"camera"};
  answer.X_AB.basis.unspecified = {"odom"};
  answer.path = {{"robot", "world", "base", ClockKind::kSystem}, {"arm", "base", "hand left", {}}};
  add("answer", answer);
}

// A recording of a partition, compressed and not.
bool write_recordings(const std::filesystem::path& folder) {
  Random random(0x4ec0);
  for (const bool compress : {false, true}) {
    const auto file = std::filesystem::temp_directory_path() / "tfdude-seed.mcap";
    std::filesystem::remove(file);
    RecordingOptions options;
    options.compress = compress;
    auto writer = RecordingWriter::create(file, time_of(0), options);
    if (!writer) return false;
    const FramesNews frames{{{"arm", "base"}, {"hand", "arm"}}, 7};
    bool good = writer->add({"arms", ReachNews{true, ""}}, time_of(1)) &&
                writer->add({"arms", frames}, time_of(2));
    WatchedValue begins{0, std::nullopt, random.transform(), {}, Covariance()};
    WatchedValue sample{1, time_of(5), random.transform(), {}, Covariance()};
    good = good && writer->add({"arms", ValuesNews{3, {begins, sample}}}, time_of(6)) &&
           writer->add(Change{ChangeKind::kPartitionUp, "arms"}, time_of(7)) &&
           writer->add("arms", {JointInfo{"elbow", "hand"}}, time_of(8)) &&
           writer->finish(time_of(9));
    if (!good) return false;
    write(folder / "recording", compress ? "compressed" : "plain", content(file));
    std::filesystem::remove(file);
  }
  return true;
}

}  // namespace
}  // namespace tfdude::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_seeds FOLDER\n", stderr);
    return 2;
  }
  tfdude::fuzz::write_samples(argv[1]);
  tfdude::fuzz::write_ros(argv[1]);
  tfdude::fuzz::write_choices(argv[1]);
  tfdude::fuzz::write_messages(argv[1]);
  tfdude::fuzz::write_one_shots(argv[1]);
  const bool written =
      tfdude::fuzz::write_states(argv[1]) && tfdude::fuzz::write_recordings(argv[1]);
  return written ? 0 : 1;
}
