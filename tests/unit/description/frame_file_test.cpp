// Files of other programs, where a text must not be taken for more, or for less, than it says. What
// the formats say is compared with numpy in python/tests/test_files.py.

#include "tfdude/description/frame_file.hpp"

#include <optional>
#include <random>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;

Result<std::vector<FrameSpec>> parsed(const std::string& text,
                                      std::optional<FrameFormat> format = {}) {
  FrameFile file;
  file.file = "file";
  file.format = format;
  return parse_frames(text, file);
}

std::string refusal(const std::string& text, std::optional<FrameFormat> format = {}) {
  const auto frames = parsed(text, format);
  return frames ? "accepted" : frames.error().message;
}

// PARENT>CHILD of each edge.
std::string edges_of(const std::string& text, std::optional<FrameFormat> format = {}) {
  const auto frames = parsed(text, format);
  if (!frames) return frames.error().message;
  std::string edges;
  for (const FrameSpec& frame : *frames) edges += frame.parent + ">" + frame.id + " ";
  return edges;
}

const std::string kRun = "ros2 run tf2_ros static_transform_publisher ";
const std::string kStart = kRun + "1 2 3 0 0 0 a b\n";

TEST_CASE("frame file: words of any length are read in a shell script") {
  for (const char filler : {'A', '1', '$', '\\'}) {
    const std::string long_word(300'000, filler);
    CHECK(edges_of(kStart + "echo \"<" + long_word + "A\" | base64 -d\n") == "a>b ");
    CHECK(edges_of(kStart + "cat <" + long_word + "A >" + long_word + "A\n") == "a>b ");
    CHECK(edges_of("cat <<" + long_word + "A\n" + long_word + "\n" + long_word + "A\n" + kStart)
              .size() < 200);
  }
  CHECK(edges_of(kStart + "x=" + std::string(300'000, '(')) == "a>b ");
  const std::string open = "x=$" + std::string(300'000, '(');
  CHECK(refusal(kStart + open) == "file:2: a substitution has no end");
}

TEST_CASE("frame file: redirections and quotes of a shell script are no arguments") {
  for (const char* redirected : {" >log", " > log", " 2>&1", " &>log", " &>>log", " >>log 2>&1",
                                 " <in", " 2>|log", " 3<&-", " >'a log'", " <<<word"}) {
    INFO(redirected);
    CHECK(edges_of(kRun + "1 2 3 0 0 0 a b" + redirected + "\n") == "a>b ");
  }
  CHECK(edges_of("(" + kRun + "1 2 3 0 0 0 a b)\n") == "a>b ");
  CHECK(edges_of(kRun + "1 2 3 0 0 0 'a b' \"c\"\\\n_d\r\n") == "a b>c_d ");
  CHECK(edges_of("/opt/lib/static_transform_publisher 1 2 3 0 0 0 a b\n") == "a>b ");
  CHECK(refusal(kRun + "1 2 3 0 0 0 $ROBOT b\n") ==
        "file:1: static_transform_publisher: '$ROBOT' is a substitution: put its value there");
  CHECK(refusal(kRun + "`cat x` 2 3 0 0 0 a b\n") ==
        "file:1: static_transform_publisher: '`cat x`' is a substitution: put its value there");
  CHECK(refusal("\n" + kRun + "1 2 3 0 0 0 'a b\n") == "file:2: a quote has no end");
}

TEST_CASE("frame file: a text of a shell script is no start") {
  for (const std::string& text :
       {"echo \"then:\n" + kStart + "\"\n", "cat <<EOF >run.sh\n" + kStart + "EOF\n",
        "cat <<-'E F'\n" + kStart + "\tE F\n", "printf '%s' '" + kStart + "'\n",
        std::string("pkill -f static_transform_publisher\n")}) {
    INFO(text);
    CHECK(edges_of(text + kRun + "1 2 3 0 0 0 c d\n") == "c>d ");
  }
  const std::string text =
      ": static_transform_publisher stands in a text here: write its start as "
      "a command of its own";
  CHECK(refusal("bash -c '" + kRun + "1 2 3 0 0 0 a b'\n") == "file:1" + text);
  CHECK(refusal("bash <<EOF\n" + kStart + "EOF\n") == "file:2" + text);
  CHECK(refusal("cat <<EOF\n" + kStart) == "file:1: a here-document has no end");
  CHECK_THAT(refusal("for i in 1 2; do if true; then\nx\nfi\n" + kStart + "done\n"),
             ContainsSubstring("file:4: static_transform_publisher is started under a condition"));
}

TEST_CASE("frame file: arguments of ROS 2 end at two dashes") {
  const auto node = [](const std::string& arguments) {
    return "<launch><node pkg='tf2_ros' exec='static_transform_publisher' args='" + arguments +
           "'/></launch>";
  };
  const std::string flags = "--x 1 --frame-id a --child-frame-id b";
  CHECK(edges_of(node("--ros-args -r __node:=st -- " + flags)) == "a>b ");
  CHECK(edges_of(node(flags + " --ros-args -r __node:=st --log-level info")) == "a>b ");
  CHECK(edges_of(node("--ros-args -p x:=1 -- " + flags + " --ros-args -p y:=2 --")) == "a>b ");
  // In time that grows with the length only.
  std::string many = flags;
  for (int i = 0; i < 200'000; ++i) many += " --ros-args --";
  CHECK(edges_of(node(many)) == "a>b ");
}

TEST_CASE("frame file: arithmetic in a shell script has no here-document") {
  CHECK(edges_of("(( x = 1 << 3 ))\n" + kStart) == "a>b ");
  CHECK(edges_of("((\n1 << 3))\n" + kStart + "3\n") == "a>b ");
  const std::string many(500'000, ';');
  CHECK(edges_of(many + "\n" + kStart) == "a>b ");
  std::string commands;
  for (int i = 0; i < 300'000; ++i) commands += ";a";
  CHECK_THAT(refusal(kStart + commands), ContainsSubstring("commands"));
}

TEST_CASE("frame file: entities that XML declares are not read") {
  for (const char* before : {"", "<!ELEMENT launch ANY> ", "<!-- the base --> "}) {
    const std::string text =
        "<?xml version='1.0'?>\n<!DOCTYPE launch [ " + std::string(before) +
        "<!ENTITY b 'base'> ]>\n<launch><node pkg='tf2_ros' "
        "exec='static_transform_publisher' args='1 2 3 0 0 0 &b; c'/></launch>";
    CHECK_THAT(refusal(text), ContainsSubstring("file:2: entities are not read"));
  }
}

TEST_CASE("frame file: escapes in strings of Python stand for what they do in Python") {
  const auto launch = [](const std::string& child) {
    return "LaunchDescription([Node(executable='static_transform_publisher', arguments=['1', '2', "
           "'3', '0', '0', '0', 'a', " +
           child + "])])\n";
  };
  CHECK(edges_of(launch(R"('cam\x31')")) == "a>cam1 ");
  CHECK(edges_of(launch(R"("c\'\"\\\101\u00e4\U0001F916")")) ==
        "a>c'\"\\A\xc3\xa4\xf0\x9f\xa4\x96 ");
  CHECK(edges_of(launch("'c\\\nd'")) == "a>cd ");
  CHECK(edges_of(launch(R"('c\d')")) == "a>c\\d ");
  for (const char* other : {R"('\N{DIGIT ONE}')", R"('\x3')", R"('\ud800')", R"(r'c\x31')"}) {
    CHECK_THAT(refusal(launch(other)), ContainsSubstring("file:1: an argument is computed by"));
  }
}

TEST_CASE("frame file: a byte order mark is left out") {
  const testing::TemporaryDirectory directory;
  FrameFile file;
  file.file = directory.write("start.sh", "\xef\xbb\xbf" + kStart);
  CHECK(load_frames(file));
  file.file = directory.write("images.txt",
                              "\xef\xbb\xbf"
                              "1 1 0 0 0 1 2 3 1 p.jpg\n\n");
  CHECK(load_frames(file));
}

const std::string kChain = "{cam0: {T_cam_imu: [1,0,0,1, 0,1,0,2, 0,0,1,3, 0,0,0,1]}}\n";
const std::string kStereo = R"({
  "R": {"type_id": "opencv-matrix", "rows": 3, "cols": 3, "data": [1,0,0, 0,1,0, 0,0,1]},
  "T": {"type_id": "opencv-matrix", "rows": 3, "cols": 1, "data": [1, 2, 3]}
})";

TEST_CASE("frame file: Kalibr and OpenCV are told apart in each of their forms") {
  const std::string json =
      R"({"cam0": {"T_cam_imu": [[1,0,0,1], [0,1,0,2], [0,0,1,3], [0,0,0,1]]}})";
  const std::string block = "cam0:\n  T_cam_imu: [1,0,0,1, 0,1,0,2, 0,0,1,3, 0,0,0,1]\n";
  for (const std::string& text : {kChain, json, block, "%YAML:1.0\n" + block,
                                  "%YAML:1.0\n---\n" + block, "%YAML 1.2\n---\n" + block}) {
    INFO(text);
    CHECK(edges_of(text) == "imu0>cam0 ");
  }
  CHECK(edges_of(kStereo) == "left>right ");
  const std::string xml =
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<R type_id=\"opencv-matrix\"></R>\n";
  const std::string why = "file: is XML, which is not read: save it as YAML or JSON";
  CHECK(refusal(xml) == why);
  CHECK(refusal(xml, FrameFormat::kOpenCv) == why);
}

TEST_CASE("frame file: sizes of OpenCV's matrices are whole numbers from 1 to 9") {
  const std::string sizes = "\"rows\": 3, \"cols\": 1";
  for (const char* wrong : {"\"rows\": -3, \"cols\": -1", "\"rows\": 1e300, \"cols\": 3e-300",
                            "\"rows\": 1.5, \"cols\": 2", "\"rows\": 0, \"cols\": 3"}) {
    std::string text = kStereo;
    text.replace(text.find(sizes), sizes.size(), wrong);
    INFO(wrong);
    CHECK(refusal(text) == "file:3: T: rows and cols are not whole numbers from 1 to 9");
  }
}

// As a file writes a matrix with a number of decimals.
std::string chain_of(const Eigen::Matrix3d& R) {
  std::string text = "cam0: {T_cam_imu: [";
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 3; ++column) {
      text += std::to_string(R(row, column)) + ", ";
    }
    text += "0, ";
  }
  return text + "0, 0, 0, 1]}\n";
}

TEST_CASE("frame file: each rotation matrix of three decimals is read as the nearest rotation") {
  const unsigned seed = std::random_device{}();
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized();
    const Eigen::Matrix3d R = q.toRotationMatrix();
    const auto frames = parsed(chain_of((R * 1e3).array().round().matrix() / 1e3));
    REQUIRE(frames);
    const Eigen::Matrix3d read = (*frames)[0].X_PC.pose.rotation().toRotationMatrix().transpose();
    REQUIRE((read - R).cwiseAbs().maxCoeff() < 2e-3);
  }
  CHECK_THAT(refusal(chain_of(1.0015 * Eigen::Matrix3d::Identity())),
             ContainsSubstring("is no rotation"));
  CHECK_THAT(refusal(chain_of(-Eigen::Matrix3d::Identity())), ContainsSubstring("is no rotation"));
}

TEST_CASE("frame file: a camera chain closes within 1 mm and 1 mrad") {
  const auto chain = [](double x, double y) {
    return "cam0: {T_cam_imu: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n"
           "cam1: {T_cn_cnm1: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], T_cam_imu: [1,0,0," +
           std::to_string(x) + ", 0,1,0," + std::to_string(y) + ", 0,0,1,0, 0,0,0,1]}\n";
  };
  CHECK(parsed(chain(0.0006, 0.0006)));
  CHECK_THAT(refusal(chain(0.0008, 0.0008)), ContainsSubstring("contradicts"));
}

TEST_CASE("frame file: the camera in the IMU is read, as OpenVINS writes it") {
  const std::string in_camera = "T_cam_imu: [0,-1,0,1, 1,0,0,2, 0,0,1,3, 0,0,0,1]";
  const std::string in_imu = "T_imu_cam: [0,1,0,-2, -1,0,0,1, 0,0,1,-3, 0,0,0,1]";
  const auto frames = parsed("cam0: {" + in_imu + "}\n");
  REQUIRE(frames);
  const Pose& X_IC = (*frames)[0].X_PC.pose;
  CHECK((X_IC.translation() - Eigen::Vector3d(-2, 1, -3)).norm() < 1e-12);
  CHECK((X_IC.rotation() * Eigen::Vector3d::UnitX() - -Eigen::Vector3d::UnitY()).norm() < 1e-12);
  CHECK(parsed("cam0: {" + in_camera + ", " + in_imu + "}\n"));
  CHECK(refusal("cam0: {" + in_camera + ", T_imu_cam: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n") ==
        "file:1: cam0: T_imu_cam contradicts T_cam_imu");
  CHECK(edges_of("cam0: {" + in_imu + "}\ncam1: {" + in_imu +
                 ", T_cn_cnm1: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n") == "imu0>cam0 imu0>cam1 ");
}

TEST_CASE("frame file: a frame that has the name of the reader's own reference is not written") {
  const auto refusal_of = [](const std::string& id, FrameFormat format) {
    Transform X;
    X.covariance = Covariance::from_stddev({1, 1, 1, 1, 1, 1}).value();
    return write_frames({{id, "earth", X}}, format);
  };
  for (const auto& [id, format] :
       {std::pair("map", FrameFormat::kG2o), std::pair("world", FrameFormat::kColmap)}) {
    const auto refused = refusal_of(id, format);
    REQUIRE_FALSE(refused);
    CHECK_THAT(refused.error().message, ContainsSubstring("below a frame of this name"));
    CHECK(refusal_of("odom", format));
  }
}

TEST_CASE("frame file: of COLMAP only images.txt is read, and each image once") {
  const std::string image = "1 1 0 0 0 1 2 3 1 p.jpg\n\n";
  CHECK(edges_of(image) == "world>p.jpg ");
  CHECK(refusal(image + "1 1 0 0 0 1 2 3 1 q.jpg\n\n") ==
        "file:3: image 1 is given twice, before in line 1");
  CHECK(refusal("1 1 0 0 0 1 2 3 foo p.jpg\n\n") ==
        "file:1: CAMERA_ID is 'foo', which is not a whole number");
  CHECK(refusal("1 1 0 1 0 0 0 0 0 1 CAMERA 1 1\n") ==
        "file:1: is a line of frames.txt: only images.txt is read");
  CHECK(refusal("1 0 1 0 0 0 0 0 0 2 CAMERA 1 1 IMU 2 1\n") ==
        "file:1: is a line of frames.txt: only images.txt is read");
  CHECK(refusal("7 1.5 2.5 3.5 115 120 90 0.4 1 12 2 15\n") ==
        "file:1: is a line of points3D.txt: only images.txt is read");
}

TEST_CASE("frame file: of COLMAP no image is taken for the points of the one before") {
  const std::string image = "1 1 0 0 0 1 2 3 1 p.jpg\n";
  const std::string of_three_words = "2 0.5 0.5 0.5 0.5 1.5 2 3 1 q r s.jpg\n";
  CHECK(refusal(image + of_three_words) ==
        "file:2: is not a line of points, X Y POINT3D_ID each; without points it is empty");
  CHECK(edges_of(image + "\n" + of_three_words + "1.5 2.5 -1 2 3 18446744073709551615\n") ==
        "world>p.jpg world>q r s.jpg ");
  CHECK_THAT(refusal(image + "1.5 2.5 0.5\n"),
             ContainsSubstring("file:2: is not a line of points"));
}

TEST_CASE("frame file: errors about covariances of images name their file") {
  const testing::TemporaryDirectory directory;
  FrameFile file;
  file.file = directory.write("images.txt", "1 1 0 0 0 1 2 3 1 p.jpg\n\n");
  file.covariances = directory.write("sigma.txt", "\n1 2 3\n");
  const auto frames = load_frames(file);
  REQUIRE_FALSE(frames);
  CHECK(frames.error().message == file.covariances + ":2: is not an IMAGE_ID and 36 numbers");
}

TEST_CASE("frame file: names of vertices are those that an export has noted") {
  const std::string vertices = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\n";
  CHECK(edges_of("# frame 1 was lost\n# frame 0 lost\n# tfdude frame\n" + vertices) ==
        "map>0 map>1 ");
  CHECK(edges_of("# tfdude frame 1 hall \t\r\n# tfdude frame 0 a b\r\n" + vertices) ==
        "map>a b map>hall ");
  // Of an earlier export, directly before the vertex.
  CHECK(edges_of("# frame 0 hall\r\n" + vertices) == "map>hall map>1 ");
  CHECK(edges_of("# frame 1 hall\n" + vertices) == "map>0 map>1 ");
  CHECK(edges_of("# frame 0 was lost\n" + vertices) == "map>0 map>1 ");
  FrameSpec frame;
  frame.id = "tool";
  frame.parent = "hand";
  frame.X_PC.covariance = *Covariance::from_stddev({0.1, 0.1, 0.1, 0.1, 0.1, 0.1});
  const auto text = write_frames({frame}, FrameFormat::kG2o);
  REQUIRE(text);
  CHECK_THAT(*text, ContainsSubstring("# tfdude frame 1 tool\n"));
  CHECK(edges_of(*text) == "map>hand map>tool ");
}

TEST_CASE("frame file: a hand-eye calibration may have leading slashes") {
  for (const char* base : {"/base", "base"}) {
    const std::string text =
        std::string("eye_on_hand: false\nrobot_base_frame: ") + base +
        "\ntracking_base_frame: //cam\ntransformation: {x: 0, y: 0, z: 0, qx: 0, qy: 0, qz: 0, "
        "qw: 1}\n";
    CHECK(edges_of(text) == "base>cam ");
  }
  CHECK(refusal("eye_on_hand: false\nrobot_base_frame: /\n", FrameFormat::kEyeOnBase) ==
        "file:2: robot_base_frame is empty");
}

TEST_CASE("frame file: a format that the file contradicts is rejected") {
  const std::string text =
      "eye_on_hand: true\nrobot_effector_frame: tool0\nrobot_base_frame: base\n"
      "tracking_base_frame: cam\ntransformation: {x: 0, y: 0, z: 0, qx: 0, qy: 0, qz: 0, qw: 1}\n";
  CHECK(edges_of(text) == "tool0>cam ");
  CHECK(edges_of(text, FrameFormat::kEyeOnHand) == "tool0>cam ");
  CHECK(refusal(text, FrameFormat::kEyeOnBase) ==
        "file:1: the format is eye-on-base, but the file says that the camera is on the hand");
}

TEST_CASE("frame file: what could not be read again is not written") {
  const auto spec = [](const std::string& id, const std::string& parent) {
    FrameSpec frame;
    frame.id = id;
    frame.parent = parent;
    return frame;
  };
  const auto why = [](const std::vector<FrameSpec>& frames, FrameFormat format) {
    const auto text = write_frames(frames, format);
    return text ? "written" : text.error().message;
  };
  for (const FrameFormat format : {FrameFormat::kKalibr, FrameFormat::kRos1, FrameFormat::kRos2,
                                   FrameFormat::kColmap, FrameFormat::kG2o}) {
    CHECK(why({spec("b", "a"), spec("b", "a")}, format) == "frame 'b': is given twice");
    CHECK(why({spec("b", "a"), spec("a", "b")}, format) == "frame 'b': is below itself");
    CHECK(why({spec("a", "a")}, format) == "frame 'a': is below itself");
  }
  for (const char* name : {"it's", "a&b", "$HOME"}) {
    CHECK(why({spec(name, "a")}, FrameFormat::kColmap) == "written");
  }
  for (const char* name : {"a\\b", "-5", "--x"}) {
    CHECK_THAT(why({spec(name, "a")}, FrameFormat::kRos1),
               ContainsSubstring("cannot have the name"));
    CHECK_THAT(why({spec("a", name)}, FrameFormat::kRos2),
               ContainsSubstring("cannot have the name"));
  }
  CHECK_THAT(why({spec("a b", "a")}, FrameFormat::kColmap), ContainsSubstring("with a space"));
}

}  // namespace
}  // namespace tfdude
