// Starts of static_transform_publisher: in launch files of ROS 1 and ROS 2 (XML, Python, YAML), and
// in shell scripts.

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "tfdude/base/id.hpp"

#include "description/file_edges.hpp"
#include "description/file_text.hpp"
#include "description/launch_starts.hpp"
#include "description/python_tokens.hpp"
#include "description/shell_text.hpp"
#include "description/xml_text.hpp"
#include "types/ros_rules.hpp"

namespace tfdude {
namespace {

using tinyxml2::XMLElement;
using Words = std::vector<std::string>;

constexpr const char* kProgram = kStaticPublisher;
using Start = LaunchStart;

// Those of ROS 2 itself end at "--", or at the end.
void drop_ros_arguments(Words& words) {
  bool drops = false;
  const auto is_of_ros = [&](const std::string& word) {
    const bool was = drops;
    drops = drops ? word != "--" : word == "--ros-args";
    return was || drops;
  };
  words.erase(std::remove_if(words.begin(), words.end(), is_of_ros), words.end());
}

class Arguments {
 public:
  Arguments(Start start, const std::string& name) : start_(std::move(start)), name_(name) {}

  [[nodiscard]] Result<FileEdge> edge() {
    Words& words = start_.words;
    drop_ros_arguments(words);
    // Names and remappings of ROS 1.
    const auto is_mapping = [](const std::string& word) {
      return word.find(":=") != std::string::npos;
    };
    words.erase(std::remove_if(words.begin(), words.end(), is_mapping), words.end());
    for (const std::string& word : words) {
      if (word.find("$(") != std::string::npos) return error(launch_substitution(word));
    }
    const bool flags = std::any_of(words.begin(), words.end(), [](const std::string& word) {
      return word.rfind("--", 0) == 0;
    });
    return flags ? flagged() : positional();
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(const std::string& message) const {
    return file_error(Errc::kInvalidInput, name_, start_.line,
                      std::string(kProgram) + ": " + message);
  }

  // --x 1 --yaw 0.5 --frame-id map --child-frame-id odom: what is left out is zero.
  [[nodiscard]] Result<FileEdge> flagged() const {
    std::map<std::string, double> numbers = {
        {"--x", 0},   {"--y", 0},  {"--z", 0},  {"--roll", 0}, {"--pitch", 0},
        {"--yaw", 0}, {"--qx", 0}, {"--qy", 0}, {"--qz", 0},   {"--qw", 1}};
    std::map<std::string, std::string> frames = {{"--frame-id", ""}, {"--child-frame-id", ""}};
    bool quaternion = false;
    bool angles = false;
    for (std::size_t i = 0; i < start_.words.size(); i += 2) {
      const std::string& flag = start_.words[i];
      if (i + 1 == start_.words.size()) return error(quote(flag) + " has no value");
      const std::string& word = start_.words[i + 1];
      if (const auto frame = frames.find(flag); frame != frames.end()) {
        frame->second = word;
        continue;
      }
      const auto found = numbers.find(flag);
      if (found == numbers.end()) return error("unknown argument " + quote(flag));
      const auto value = number_of(word);
      if (!value) return error(flag + " is " + quote(word) + ", which is not a number");
      found->second = *value;
      quaternion = quaternion || flag[2] == 'q';
      angles = angles || flag.size() > 4;
    }
    if (quaternion && angles) return error("a quaternion and angles are both given");
    const auto value = [&](const char* flag) { return numbers.find(flag)->second; };
    const Eigen::Quaterniond rotation =
        quaternion ? Eigen::Quaterniond(value("--qw"), value("--qx"), value("--qy"), value("--qz"))
                   : from_rpy(value("--roll"), value("--pitch"), value("--yaw"));
    return made(rotation, {value("--x"), value("--y"), value("--z")}, frames["--frame-id"],
                frames["--child-frame-id"]);
  }

  // x y z yaw pitch roll PARENT CHILD, or x y z qx qy qz qw PARENT CHILD; in tf with a period.
  [[nodiscard]] Result<FileEdge> positional() const {
    const Words& words = start_.words;
    const auto is_number = [&](std::size_t i) { return number_of(words[i]).has_value(); };
    bool quaternion = words.size() == 10;
    if (words.size() == 9) {
      const bool period = is_number(8) && (!is_number(6) || start_.of_tf);
      quaternion = !period;
    } else if (words.size() != 8 && words.size() != 10) {
      return error("has " + std::to_string(words.size()) +
                   " arguments, but 8 are needed (x y z yaw pitch roll PARENT CHILD) or 9 "
                   "(x y z qx qy qz qw PARENT CHILD), and in tf a period");
    }
    std::vector<double> numbers;
    for (std::size_t i = 0; i < (quaternion ? 7U : 6U); ++i) {
      const auto value = number_of(words[i]);
      if (!value) return error(quote(words[i]) + " is not a number");
      numbers.push_back(*value);
    }
    const std::size_t first = numbers.size();
    const Eigen::Quaterniond rotation =
        quaternion ? Eigen::Quaterniond(numbers[6], numbers[3], numbers[4], numbers[5])
                   : from_rpy(numbers[5], numbers[4], numbers[3]);
    return made(rotation, {numbers[0], numbers[1], numbers[2]}, words[first], words[first + 1]);
  }

  [[nodiscard]] Result<FileEdge> made(const Eigen::Quaterniond& rotation,
                                      const Eigen::Vector3d& translation, std::string_view parent,
                                      std::string_view child) const {
    FileEdge edge;
    edge.line = start_.line;
    edge.frame.parent = ros::without_slashes(parent);
    edge.frame.id = ros::without_slashes(child);
    if (edge.frame.parent.empty()) return error("has no parent frame");
    if (edge.frame.id.empty()) return error("has no child frame");
    const auto pose = ros::pose_of(rotation, translation);
    if (!pose) return error(pose.error().message);
    edge.frame.X_PC.pose = *pose;
    return edge;
  }

  Start start_;
  const std::string& name_;
};

// Whether the conditions of an element hold.
Result<bool> holds(const XMLElement& element, const std::string& name) {
  for (const bool wanted : {true, false}) {
    const char* said = element.Attribute(wanted ? "if" : "unless");
    if (said == nullptr) continue;
    const auto yes =
        launch_condition(said, std::string("<") + element.Name() + ">", name, element.GetLineNum());
    if (!yes) return yes;
    if (*yes != wanted) return false;
  }
  return true;
}

// Whether its conditions hold, and those of all that it is in.
Result<bool> all_hold(const XMLElement& element, const std::string& name) {
  Result<bool> happens = true;
  for (const auto* outer = &element; happens && *happens && outer != nullptr;) {
    happens = holds(*outer, name);
    outer = outer->Parent() == nullptr ? nullptr : outer->Parent()->ToElement();
  }
  return happens;
}

bool is_value(const char* attribute, const char* value) {
  return attribute != nullptr && std::strcmp(attribute, value) == 0;
}

// Finds the elements that start the program, in the order of the file.
class StartSearch final : public tinyxml2::XMLVisitor {
 public:
  [[nodiscard]] const std::vector<const XMLElement*>& found() const { return found_; }
  // Those that name the program where only the launch system could tell its start.
  [[nodiscard]] const std::vector<const XMLElement*>& unread() const { return unread_; }

  bool VisitEnter(const XMLElement& element, const tinyxml2::XMLAttribute* /*first*/) override {
    const bool node = std::strcmp(element.Name(), "node") == 0;
    const bool named = is_value(element.Attribute("type"), kProgram) ||
                       is_value(element.Attribute("exec"), kProgram);
    if (node && named) found_.push_back(&element);
    for (const char* attribute : {"cmd", "default", "value", "launch-prefix"}) {
      const char* said = element.Attribute(attribute);
      if (said != nullptr && mentions_publisher(said)) unread_.push_back(&element);
    }
    return true;
  }

 private:
  std::vector<const XMLElement*> found_;
  std::vector<const XMLElement*> unread_;
};

Result<std::vector<Start>> starts_in_xml(const std::string& text, const std::string& name) {
  tinyxml2::XMLDocument document;
  const auto root = parse_xml(document, text, name);
  if (!root) return tl::unexpected(root.error());
  StartSearch search;
  if (*root != nullptr) (*root)->Accept(&search);
  for (const XMLElement* element : search.unread()) {
    const auto happens = all_hold(*element, name);
    if (happens && !*happens) continue;
    return file_error(Errc::kInvalidInput, name, element->GetLineNum(), unread_start());
  }
  std::vector<Start> starts;
  for (const XMLElement* node : search.found()) {
    auto happens = all_hold(*node, name);
    if (!happens) return tl::unexpected(std::move(happens.error()));
    if (!*happens) continue;
    const char* arguments = node->Attribute("args");
    auto words = launch_words(arguments == nullptr ? "" : arguments, name, node->GetLineNum());
    if (!words) return tl::unexpected(std::move(words.error()));
    starts.push_back(
        {*std::move(words), is_value(node->Attribute("pkg"), "tf"), node->GetLineNum()});
  }
  return starts;
}

Result<std::vector<Start>> starts_in_python(const std::string& text, const std::string& name) {
  auto calls = python_arguments(text, name);
  if (!calls) return tl::unexpected(std::move(calls.error()));
  std::vector<Start> starts;
  for (PythonArguments& call : *calls) starts.push_back({std::move(call.words), false, call.line});
  return starts;
}

// Its top-level key; no other kind of file has such a line.
bool is_yaml(const std::string& text) {
  TextLines lines(text);
  while (lines.next()) {
    if (lines.line().rfind("launch:", 0) == 0) return true;
  }
  return false;
}

Result<std::vector<Start>> starts_of(const std::string& text, const std::string& name) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text[first] == '<') return starts_in_xml(text, name);
  if (text.find("LaunchDescription") != std::string::npos) return starts_in_python(text, name);
  if (is_yaml(text)) return starts_in_yaml(text, name);
  return starts_in_shell(text, name);
}

}  // namespace

bool is_publisher(std::string_view word) {
  const std::string_view program = kStaticPublisher;
  if (word.size() < program.size()) return false;
  const auto begin = word.size() - program.size();
  return word.substr(begin) == program && (begin == 0 || word[begin - 1] == '/');
}

bool mentions_publisher(std::string_view text) {
  const std::string_view program = kStaticPublisher;
  const auto goes_on = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
  };
  for (auto at = text.find(program); at != std::string_view::npos; at = text.find(program, at)) {
    const bool begins = at == 0 || !goes_on(text[at - 1]);
    at += program.size();
    if (begins && (at == text.size() || !goes_on(text[at]))) return true;
  }
  return false;
}

std::string unread_start() {
  return std::string(kStaticPublisher) +
         " is started here in a way that is not read: start it as a node, with its arguments";
}

Result<std::vector<std::string>> launch_words(std::string_view text, const std::string& file,
                                              int line) {
  ShellText rest(text, file, line, ShellRules::kShlex);
  Words words;
  while (rest.skip_blanks()) {
    ShellWord word;
    if (auto ok = rest.word(word); !ok) return tl::unexpected(std::move(ok.error()));
    words.push_back(std::move(word.text));
  }
  return words;
}

std::string launch_substitution(const std::string& word) {
  return quote(word) + " is a substitution: put its value there";
}

Result<bool> launch_condition(std::string_view said, const std::string& what,
                              const std::string& file, int line) {
  const bool yes = said == "true" || said == "1" || said == "True";
  if (yes || said == "false" || said == "0" || said == "False") return yes;
  return file_error(Errc::kInvalidInput, file, line,
                    what + " depends on " + quote(said) + ": put true or false there");
}

FileEdges read_launch(const std::string& text, const std::string& name) {
  auto starts = starts_of(text, name);
  if (!starts) return tl::unexpected(std::move(starts.error()));
  std::vector<FileEdge> edges;
  for (Start& start : *starts) {
    auto edge = Arguments(std::move(start), name).edge();
    if (!edge) return tl::unexpected(std::move(edge.error()));
    edges.push_back(*std::move(edge));
  }
  return edges;
}

}  // namespace tfdude
