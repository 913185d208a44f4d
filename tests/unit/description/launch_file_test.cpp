// Starts of static_transform_publisher: no form of a start may be lost beside another one.

#include <optional>
#include <string>
#include <vector>

#include "tfdude/description/frame_file.hpp"

#include "support/catch.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;

// PARENT>CHILD of each edge, or what is wrong.
std::string edges_of(const std::string& text) {
  FrameFile file;
  file.file = "file";
  const auto frames = parse_frames(text, file);
  if (!frames) return frames.error().message;
  std::string edges;
  for (const FrameSpec& frame : *frames) edges += frame.parent + ">" + frame.id + " ";
  return edges;
}

// A launch file of each form with these arguments; the quotes in them are those of XML and YAML.
std::vector<std::string> launches(const std::string& arguments) {
  return {
      "<launch><node pkg=\"tf\" type=\"static_transform_publisher\" name=\"n\" args=\"" +
          arguments + "\"/></launch>",
      "<launch><node pkg=\"tf2_ros\" exec=\"static_transform_publisher\" args=\"" + arguments +
          "\"/></launch>",
      "launch:\n- node:\n    pkg: tf2_ros\n    exec: static_transform_publisher\n    args: >-\n"
      "      " +
          arguments + "\n",
      "import shlex\nld = LaunchDescription([Node(executable='static_transform_publisher', "
      "arguments=shlex.split(\"\"\"" +
          arguments + "\"\"\"))])\n",
  };
}

// A start that is read, and beside it this.
std::string python(const std::string& other) {
  return "def generate_launch_description():\n"
         "    ok = Node(package='tf2_ros', executable='static_transform_publisher', "
         "arguments=['0', '0', '0', '0', '0', '0', 'a', 'b'])\n" +
         other + "    return LaunchDescription([ok])\n";
}

const std::string kUnread =
    "static_transform_publisher is started here in a way that is not read: start it as a node, "
    "with its arguments";

}  // namespace

TEST_CASE("launch file: arguments are divided as by a shell") {
  for (const std::string& text : launches("0 0 0 0 0 0 a 'b'")) CHECK(edges_of(text) == "a>b ");
  for (const std::string& text : launches("--frame-id 'a b' --child-frame-id c'd'e --x 1")) {
    CHECK(edges_of(text) == "a b>cde ");
  }
  for (const std::string& text : launches("0 0 0 0 0 0 a$b;c|d 'e\\q'")) {
    CHECK(edges_of(text) == "a$b;c|d>e\\q ");
  }
  for (const std::string& text : launches("0 0 0 0 0 0 a 'b")) {
    INFO(text);
    CHECK_THAT(edges_of(text), ContainsSubstring("a quote has no end"));
  }
  CHECK(edges_of(launches("0 0 0 0 0 0 a &quot;b\\&quot; c&quot;").front()) == "a>b\" c ");
  CHECK(edges_of(launches("0 0 0 0 0 0\n a\\ b \t c").front()) == "a b>c ");
  CHECK(edges_of(launches("0 0 0 0 0 0 a b\\").front()) == "file:1: an escape has no end");
  // Python's own split() knows no quotes.
  CHECK(edges_of("LaunchDescription([Node(executable='static_transform_publisher', "
                 "arguments=\"0 0 0 0 0\\n0 a 'b'\".split())])") == "a>'b' ");
}

TEST_CASE("launch file: a start in Python that is not read is rejected by name") {
  const std::string arguments = "arguments=['0', '0', '1', '0', '0', '0', 'map', 'odom']";
  const std::string start = "ros2 run tf2_ros static_transform_publisher 0 0 1 0 0 0 map odom";
  const std::vector<std::string> others = {
      "    x = ExecuteProcess(cmd=['" + start + "'], shell=True)\n",
      "    x = ExecuteProcess(cmd='" + start + "'.split())\n",
      "    stp = 'static_transform_publisher'; x = Node(executable=stp, " + arguments + ")\n",
      "    x = Node(**{'executable': 'static_transform_publisher', 'arguments': []})\n",
      "    x = run('tf2_ros', 'static_transform_publisher', '0', '0')\n",
      "    x = [f'" + start + "']\n",
      "    x = ['\\N{BULLET} /opt/static_transform_publisher']\n"};
  for (const std::string& other : others) {
    INFO(other);
    CHECK(edges_of(python(other)) == "file:3: " + kUnread);
  }
  CHECK(edges_of(python("    x = Node(executable='static_' 'transform_publisher', " + arguments +
                        ")\n")) == "a>b map>odom ");
}

TEST_CASE("launch file: what only tells of the program in Python is no start") {
  for (const char* other :
       {"    'Runs static_transform_publisher.'\n", "    print('static_transform_publisher')\n",
        "    x = LogInfo(msg=['static_transform_publisher', ' runs'])\n",
        "    logger.info(f'starts static_transform_publisher')\n",
        "    x = DeclareLaunchArgument('z', description='of the static_transform_publisher')\n",
        "    x = Node(name='static_transform_publisher', executable='other', arguments=['1'])\n",
        "    x = 'static_transform_publisher_1'\n", "    # static_transform_publisher\n"}) {
    INFO(other);
    CHECK(edges_of(python(other)) == "a>b ");
  }
}

// Once, a file of 1 MB that names the program again after each list took all memory.
TEST_CASE("launch file: arguments of a call in Python are read once") {
  const auto start = [](const std::string& frames) {
    return "['static_transform_publisher', '0', '0', '0', '0', '0', '0', " + frames + "]";
  };
  CHECK(edges_of("LaunchDescription\nf(arguments=['0', '0', '0', '0', '0', '0', 'a', 'b'], "
                 "'static_transform_publisher', " +
                 start("'c', 'd'") + ", 'static_transform_publisher', " + start("'e', 'f'") +
                 ", 'static_transform_publisher')\n") == "a>b c>d e>f ");
}

TEST_CASE("launch file: a start in XML or YAML that is not read is rejected by name") {
  const auto xml = [](const std::string& other) {
    return "<launch><node pkg=\"tf2_ros\" exec=\"static_transform_publisher\" args=\"0 0 0 0 0 0 a "
           "b\"/>\n" +
           other + "</launch>";
  };
  for (const char* other :
       {"<executable cmd=\"ros2 run tf2_ros static_transform_publisher 0 0 0 0 0 0 a c\"/>",
        "<arg name=\"x\" default=\"static_transform_publisher\"/>",
        "<group><let name=\"x\" value=\"/opt/static_transform_publisher\"/></group>"}) {
    INFO(other);
    CHECK(edges_of(xml(other)) == "file:2: " + kUnread);
  }
  CHECK(edges_of(xml("<group if=\"0\"><executable cmd=\"static_transform_publisher\"/></group>")) ==
        "a>b ");
  const auto yaml = [](const std::string& other) {
    return "launch:\n- node: {pkg: tf2_ros, exec: static_transform_publisher, args: 0 0 0 0 0 0 a "
           "b}\n" +
           other;
  };
  CHECK(
      edges_of(yaml("- executable: {cmd: ros2 run tf2_ros static_transform_publisher 0 0 0}\n")) ==
      "file:3: " + kUnread);
  CHECK(edges_of(yaml("- let: {name: x, value: static_transform_publisher}\n")) ==
        "file:3: " + kUnread);
  CHECK(edges_of(yaml("- let: {name: static_transform_publisher, value: x}\n")) == "a>b ");
}

TEST_CASE("launch file: a start in a variable of a shell script is rejected by name") {
  const std::string start = "ros2 run tf2_ros static_transform_publisher 0 0 0 0 0 0 a b\n";
  for (const char* other :
       {"CMD=\"static_transform_publisher 0 0 0 0 0 0 a c\"\n$CMD\n",
        "STP=static_transform_publisher\n", "run \"x;static_transform_publisher\"\n",
        "alias p='ros2 run tf2_ros static_transform_publisher'\n",
        "x=/opt/static_transform_publisher;\n"}) {
    INFO(other);
    CHECK_THAT(edges_of(start + other),
               ContainsSubstring("file:2: ") && ContainsSubstring("static_transform_publisher"));
  }
  for (const char* other :
       {"echo \"CMD=static_transform_publisher\"\n", "LOG=static_transform_publisher.log\n",
        "x=my_static_transform_publisher\n"}) {
    INFO(other);
    CHECK(edges_of(start + other) == "a>b ");
  }
}

// Once, the first of these ended the program, and the second did not end.
TEST_CASE("launch file: aliases in YAML cannot make it endless") {
  const std::string start =
      "node: {pkg: tf2_ros, exec: static_transform_publisher, args: '0 0 0 0 0 0 a b'}\n";
  CHECK(edges_of("launch: &g\n- group: *g\n- " + start) ==
        "file:2: an alias stands for what it is in");
  CHECK(edges_of("launch:\n- &g\n  group: [*g]\n- " + start) ==
        "file:3: an alias stands for what it is in");
  // Each group has twice what the one before has.
  const auto doubled = [&](int times) {
    std::string text = "launch:\n- group: &g0\n  - " + start;
    for (int i = 1; i <= times; ++i) {
      const std::string before = "{group: *g" + std::to_string(i - 1) + "}";
      text += "- group: &g" + std::to_string(i) + " [" + before + ", " + before + "]\n";
    }
    return text;
  };
  CHECK_THAT(edges_of(doubled(26)), ContainsSubstring(": aliases repeat more than 2000000 values"));
  CHECK_THAT(edges_of(doubled(200)),
             ContainsSubstring(": aliases repeat more than 2000000 values"));
  // Each has what the one before has, two levels deeper.
  std::string nested = "launch:\n- group: &g0\n  - " + start;
  for (int i = 1; i <= 300; ++i) {
    nested += "- group: &g" + std::to_string(i) + " [{group: *g" + std::to_string(i - 1) + "}]\n";
  }
  CHECK_THAT(edges_of(nested), ContainsSubstring(": aliases nest more than 500 levels"));
  CHECK(edges_of("launch:\n- &n\n  " + start + "- group: [{group: [*n]}]\n") != "a>b ");
  CHECK(edges_of("x: &n {" + start.substr(0, start.size() - 1) + "}\nlaunch:\n- group: [*n]\n") ==
        "a>b ");
}

}  // namespace tfdude
