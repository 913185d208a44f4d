#include "description/urdf_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>
#include <tinyxml2.h>

#include "tfdude/base/id.hpp"
#include "tfdude/description/urdf_file.hpp"

#include "description/file_edges.hpp"
#include "description/file_text.hpp"
#include "description/xml_text.hpp"

namespace tfdude {
namespace {

using tinyxml2::XMLElement;

// An element of a joint, and those of its attributes that urdfdom gets to see.
struct Kept {
  const char* element;
  std::vector<const char*> attributes;
};

bool moves(std::string_view type) {
  return type != "fixed" && type != "floating" && type != "planar";
}

std::vector<Kept> kept_of(std::string_view type) {
  std::vector<Kept> kept = {{"origin", {"xyz", "rpy"}}, {"parent", {"link"}}, {"child", {"link"}}};
  if (!moves(type)) return kept;
  kept.push_back({"axis", {"xyz"}});
  if (type != "continuous") kept.push_back({"limit", {"lower", "upper"}});
  kept.push_back({"mimic", {"joint", "multiplier", "offset"}});
  return kept;
}

constexpr const char* kRunXacro = ": run xacro first, and load its output";

// Finds the first element of xacro: a file with macros is not yet a URDF.
class XacroSearch final : public tinyxml2::XMLVisitor {
 public:
  [[nodiscard]] const XMLElement* found() const { return found_; }

  bool VisitEnter(const XMLElement& element, const tinyxml2::XMLAttribute* /*first*/) override {
    if (std::strncmp(element.Name(), "xacro:", 6) == 0) found_ = &element;
    return found_ == nullptr;
  }

 private:
  const XMLElement* found_ = nullptr;
};

bool is_expression(const std::string& text) {
  return text.find("${") != std::string::npos || text.find("$(") != std::string::npos;
}

// An attribute as XML defines it: a tab or line end in it is a space. Empty if there is none.
std::string attribute(const XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  std::string text = value == nullptr ? "" : value;
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
  return text;
}

// 1 or -1 for a text such as "inf", "+INF" or "-infinity", otherwise 0.
int infinity_of(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' ');
  if (begin == std::string::npos) return 0;
  std::string word = text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
  const int sign = word[0] == '-' ? -1 : 1;
  if (word[0] == '-' || word[0] == '+') word.erase(0, 1);
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word == "inf" || word == "infinity" ? sign : 0;
}

// The quaternion x y z w of an <origin>. Its numbers are read as those of the other attributes.
std::optional<Eigen::Quaterniond> quaternion_of(const std::string& text) {
  const auto words = words_of(text);
  const auto xyzw = numbers_of<4>(words, 0);
  if (words.size() != 4 || !xyzw) return std::nullopt;
  const auto& [x, y, z, w] = *xyzw;
  return Eigen::Quaterniond(w, x, y, z);
}

std::string described(const char* kind, const std::string& name) {
  return std::string(kind) + " " + quote(name);
}

class TextReader {
 public:
  TextReader(UrdfText& text, const std::string& file) : text_(text), file_(file) {}

  [[nodiscard]] Result<void> robot(const XMLElement& robot) {
    printer_.OpenElement("robot");
    printer_.PushAttribute("name", "robot");
    for (const auto* element = robot.FirstChildElement(); element != nullptr;
         element = element->NextSiblingElement()) {
      const std::string_view kind = element->Name();
      auto read = kind == "link"    ? link(*element)
                  : kind == "joint" ? joint(*element)
                                    : Result<void>();
      if (!read) return read;
    }
    printer_.CloseElement();
    text_.cleaned = printer_.CStr();
    return {};
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(const XMLElement& element,
                                            const std::string& message) const {
    return file_error(Errc::kInvalidInput, file_, element.GetLineNum(), message);
  }

  // An expression of xacro would be a name like any other.
  [[nodiscard]] Result<void> check_expanded(const XMLElement& element, const char* name) const {
    const std::string value = attribute(element, name);
    if (!is_expression(value)) return {};
    return file_error(Errc::kConfig, file_, element.GetLineNum(),
                      quote(value) + " is an expression of xacro" + kRunXacro);
  }

  void push(const XMLElement& element, const char* name) {
    if (element.Attribute(name) == nullptr) return;
    printer_.PushAttribute(name, attribute(element, name).c_str());
  }

  [[nodiscard]] Result<void> link(const XMLElement& element) {
    text_.links.push_back({attribute(element, "name"), element.GetLineNum()});
    if (text_.links.back().name.empty()) return error(element, "a link has no name");
    if (auto ok = check_expanded(element, "name"); !ok) return ok;
    printer_.OpenElement("link");
    push(element, "name");
    printer_.CloseElement();
    return {};
  }

  [[nodiscard]] Result<void> joint(const XMLElement& element) {
    UrdfText::Joint joint;
    joint.name = attribute(element, "name");
    joint.line = element.GetLineNum();
    if (joint.name.empty()) return error(element, "a joint has no name");
    for (const char* name : {"name", "type"}) {
      if (auto ok = check_expanded(element, name); !ok) return ok;
    }
    const std::string what = described("joint", joint.name);
    printer_.OpenElement("joint");
    push(element, "name");
    push(element, "type");
    for (const Kept& kept : kept_of(attribute(element, "type"))) {
      const auto* part = element.FirstChildElement(kept.element);
      if (part == nullptr) continue;
      if (const auto* again = part->NextSiblingElement(kept.element)) {
        return error(*again, what + ": <" + kept.element + "> is given twice");
      }
      if (auto ok = push_part(*part, kept, what); !ok) return ok;
      if (kept.element == std::string_view("origin")) {
        if (auto ok = read_quaternion(*part, what, joint); !ok) return ok;
      }
      if (kept.element == std::string_view("parent")) joint.parent = attribute(*part, "link");
      if (kept.element == std::string_view("child")) joint.child = attribute(*part, "link");
    }
    printer_.CloseElement();
    if (joint.parent.empty()) return error(element, what + ": has no <parent link=\"...\">");
    if (joint.child.empty()) return error(element, what + ": has no <child link=\"...\">");
    text_.joints.push_back(std::move(joint));
    return {};
  }

  // An attribute of later URDF versions than urdfdom may know.
  [[nodiscard]] Result<void> read_quaternion(const XMLElement& origin, const std::string& what,
                                             UrdfText::Joint& joint) const {
    if (origin.Attribute("quat_xyzw") == nullptr) return {};
    if (auto ok = check_expanded(origin, "quat_xyzw"); !ok) return ok;
    if (origin.Attribute("rpy") != nullptr) {
      return error(origin, what + ": rpy and quat_xyzw are both given, one is enough");
    }
    const std::string text = attribute(origin, "quat_xyzw");
    joint.rotation = quaternion_of(text);
    if (joint.rotation) return {};
    return error(origin, what + ": quat_xyzw is " + quote(text) + ", which is not four numbers");
  }

  // A limit that is infinite or not given is none. If only one of them is given, the other one is
  // zero, as URDF defines it. Without both, URDF would fix the joint at zero, which nobody means.
  [[nodiscard]] Result<void> push_limits(const XMLElement& limit, const std::string& what) {
    const bool none = !limit.Attribute("lower") && !limit.Attribute("upper");
    for (const bool is_lower : {true, false}) {
      const char* name = is_lower ? "lower" : "upper";
      const std::string value = attribute(limit, name);
      const int infinity = infinity_of(value);
      if (infinity == (is_lower ? 1 : -1)) {
        return error(limit, what + ": " + name + " is " + quote(value) +
                                ": no position is within the limits");
      }
      if (none || infinity != 0) {
        // urdfdom cannot read infinity. This is beyond every valid position.
        printer_.PushAttribute(name, is_lower ? "-1e300" : "1e300");
      } else {
        push(limit, name);
      }
    }
    // urdfdom requires these attributes.
    printer_.PushAttribute("effort", "0");
    printer_.PushAttribute("velocity", "0");
    return {};
  }

  [[nodiscard]] Result<void> push_part(const XMLElement& part, const Kept& kept,
                                       const std::string& what) {
    printer_.OpenElement(kept.element);
    const bool limits = kept.element == std::string_view("limit");
    for (const char* name : kept.attributes) {
      if (auto ok = check_expanded(part, name); !ok) return ok;
      // urdfdom logs a bad number as a format of printf, so it must contain no percent sign.
      const std::string value = attribute(part, name);
      const bool names = std::strcmp(name, "link") == 0 || std::strcmp(name, "joint") == 0;
      if (!names && value.find('%') != std::string::npos) {
        return error(part, what + ": " + name + " is " + quote(value) + ", which is no number");
      }
      if (!limits) push(part, name);
    }
    if (limits) {
      if (auto ok = push_limits(part, what); !ok) return ok;
    }
    printer_.CloseElement();
    return {};
  }

  UrdfText& text_;
  const std::string& file_;
  tinyxml2::XMLPrinter printer_;
};

Result<const XMLElement*> parse_robot(tinyxml2::XMLDocument& document, const std::string& text,
                                      const std::string& file) {
  auto root = parse_xml(document, text, file);
  if (!root) return root;
  const XMLElement* robot = *root;
  if (robot == nullptr) return fail(Errc::kConfig, file + ": has no element <robot>");
  if (std::strcmp(robot->Name(), "robot") == 0) return root;
  return file_error(Errc::kConfig, file, robot->GetLineNum(),
                    "not a URDF: <" + printable(robot->Name()) + "> instead of <robot>");
}

}  // namespace

Result<std::string> load_urdf_text(const std::string& file) {
  auto text = read_text(file);
  if (!text) return text;
  tinyxml2::XMLDocument document;
  const auto robot = parse_robot(document, *text, printable(file));
  if (!robot) return tl::unexpected(robot.error());
  return text;
}

Result<UrdfText> read_urdf_text(const std::string& text, const std::string& file) {
  tinyxml2::XMLDocument document;
  const auto root = parse_robot(document, text, file);
  if (!root) return tl::unexpected(root.error());
  const XMLElement* robot = *root;
  XacroSearch search;
  robot->Accept(&search);
  if (search.found() != nullptr) {
    return file_error(Errc::kConfig, file, search.found()->GetLineNum(),
                      "<" + printable(search.found()->Name()) + "> is a xacro element" + kRunXacro);
  }
  UrdfText found;
  if (auto ok = TextReader(found, file).robot(*robot); !ok) return tl::unexpected(ok.error());
  if (found.links.empty()) {
    return file_error(Errc::kInvalidInput, file, robot->GetLineNum(), "has no links");
  }
  return found;
}

}  // namespace tfdude
