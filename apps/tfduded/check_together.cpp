#include <map>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"

#include "check.hpp"

namespace tfdude::daemon {
namespace {

// A frame, and where it is described.
struct Described {
  const Config* config;
  std::size_t index;

  [[nodiscard]] const FrameSpec& frame() const { return config->frames[index]; }
  [[nodiscard]] std::string place() const {
    return config->places[index] + ", partition " + quote(config->partition);
  }
};
using ByName = std::map<std::string, Described>;

std::string both(const std::string& what, const Described& a, const Described& b) {
  return what + " is in " + a.place() + ", and in " + b.place();
}

// Names a frame of each cycle. A cycle within one configuration is an error of that one.
void find_cycles(const ByName& frames, std::vector<std::string>& wrong) {
  std::set<std::string> done;
  for (const auto& [id, described] : frames) {
    std::set<std::string> path;
    std::string here = id;
    while (done.count(here) == 0 && path.insert(here).second) {
      const auto parent = frames.find(frames.at(here).frame().parent);
      if (parent == frames.end()) break;
      here = parent->first;
    }
    if (done.count(here) == 0 && frames.count(frames.at(here).frame().parent) > 0) {
      wrong.push_back("frame " + quote(here) + " lies below itself: " + frames.at(here).place());
    }
    done.merge(path);
  }
}

}  // namespace

std::vector<std::string> contradictions(const std::vector<Config>& configs) {
  std::vector<std::string> wrong;
  std::set<std::string> partitions;
  ByName frames;
  ByName joints;  // without those that mimic others
  for (const Config& config : configs) {
    if (!partitions.insert(config.partition).second) {
      wrong.push_back("partition " + quote(config.partition) + " has two configurations");
    }
    for (std::size_t i = 0; i < config.frames.size(); ++i) {
      const Described one{&config, i};
      const FrameSpec& frame = one.frame();
      const auto& joint = frame.joint;
      const auto [there, fresh] = frames.emplace(frame.id, one);
      if (!fresh) wrong.push_back(both("frame " + quote(frame.id), there->second, one));
      if (!joint || joint->mimic) continue;
      const auto [same, new_joint] = joints.emplace(joint->name, one);
      if (!new_joint) wrong.push_back(both("joint " + quote(joint->name), same->second, one));
    }
  }
  for (const auto& [id, one] : frames) {
    const std::string& parent = one.frame().parent;
    if (!parent.empty() && frames.count(parent) == 0) {
      wrong.push_back("frame " + quote(id) + " in " + one.place() + ": no configuration has its " +
                      "parent " + quote(parent));
    }
    const auto& joint = one.frame().joint;
    if (joint && joint->mimic && joints.count(joint->mimic->joint) == 0) {
      wrong.push_back("joint " + quote(joint->name) + " in " + one.place() +
                      ": no configuration has the joint " + quote(joint->mimic->joint) +
                      " that it mimics");
    }
  }
  find_cycles(frames, wrong);
  return wrong;
}

}  // namespace tfdude::daemon
