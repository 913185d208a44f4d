#pragma once

#include <string>
#include <vector>

#include "tfdude/description/urdf.hpp"

#include "support/catch.hpp"

/// Small URDFs, and what is read of them.
namespace tfdude::testing {

/// A robot whose elements begin in line 2.
inline std::string robot(const std::string& elements) {
  return "<robot name=\"r\">\n" + elements + "</robot>\n";
}

inline std::string link(const std::string& name) { return "<link name=\"" + name + "\"/>\n"; }

inline std::string joint(const std::string& name, const std::string& type,
                         const std::string& parent, const std::string& child,
                         const std::string& more = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/>" + more + "</joint>\n";
}

/// Links a and b, the second moved by joint j, which is in line 4.
inline std::string pair(const std::string& type, const std::string& more = "") {
  return robot(link("a") + link("b") + joint("j", type, "a", "b", more));
}

inline std::string limits(const std::string& lower, const std::string& upper) {
  return "<limit lower=\"" + lower + "\" upper=\"" + upper + "\"/>";
}

/// Three fingers of a hand: f2 mimics f1, f3 mimics f2; and one alone.
inline std::string hand() {
  const auto finger = [](int i, const std::string& more) {
    const std::string n = std::to_string(i);
    return link("l" + n) + joint("f" + n, "prismatic", "hand", "l" + n, limits("-1", "3") + more);
  };
  return robot(link("hand") + finger(1, "") +
               finger(2, "<mimic joint=\"f1\" multiplier=\"-2\" offset=\"0.5\"/>") +
               finger(3, "<mimic joint=\"f2\" multiplier=\"3\" offset=\"0.25\"/>") + finger(4, ""));
}

/// base - turn - lift - tool, with a camera at lift.
inline std::string tree() {
  return robot(link("base") + link("turn") + link("lift") + link("tool") + link("camera") +
               joint("j1", "continuous", "base", "turn") +
               joint("j2", "prismatic", "turn", "lift", limits("0", "1")) +
               joint("j3", "fixed", "lift", "tool") + joint("j4", "floating", "lift", "camera"));
}

inline std::vector<FrameSpec> frames_of(const std::string& text,
                                        const UrdfPart& part = {"r.urdf"}) {
  const auto frames = parse_urdf(text, part);
  INFO((frames ? "" : frames.error().message));
  REQUIRE(frames.has_value());
  return *frames;
}

inline std::string ids_of(const std::vector<FrameSpec>& frames) {
  std::string ids;
  for (const auto& frame : frames) ids += (ids.empty() ? "" : " ") + frame.id;
  return ids;
}

inline void refused(const std::string& text, const UrdfPart& part, const std::string& message,
                    Errc code = Errc::kInvalidInput) {
  CAPTURE(text);
  const auto frames = parse_urdf(text, part);
  REQUIRE_FALSE(frames.has_value());
  CHECK(frames.error().message == message);
  CHECK(to_string(frames.error().code) == to_string(code));
}

inline void refused(const std::string& text, const std::string& message,
                    Errc code = Errc::kInvalidInput) {
  refused(text, {"r.urdf"}, message, code);
}

inline UrdfPart with_joint(const std::string& name, const UrdfJoint& said) {
  UrdfPart part{"r.urdf"};
  part.joints[name] = said;
  return part;
}

inline UrdfPart with_links(const std::vector<std::string>& links) {
  UrdfPart part{"r.urdf"};
  part.links = links;
  return part;
}

}  // namespace tfdude::testing
