#include "description/urdf_model.hpp"

#include <algorithm>
#include <thread>
#include <vector>

#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"
#include "description/file_text.hpp"

namespace tfdude {
namespace {

// Collects urdfdom's messages instead of printing them. The output handler of console_bridge
// belongs to the whole process, so messages of other threads go to the previous handler.
class Listener final : public console_bridge::OutputHandler {
 public:
  Listener() { console_bridge::useOutputHandler(this); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() override { console_bridge::useOutputHandler(other_); }

  [[nodiscard]] const std::vector<std::string>& said() const { return said_; }

  void log(const std::string& text, console_bridge::LogLevel level, const char* file,
           int line) override {
    if (std::this_thread::get_id() == thread_) {
      said_.push_back(text);
    } else if (other_ != nullptr) {
      other_->log(text, level, file, line);
    }
  }

 private:
  std::thread::id thread_ = std::this_thread::get_id();
  console_bridge::OutputHandler* other_ = console_bridge::getOutputHandler();
  std::vector<std::string> said_;
};

// The error names the joint that a message has in brackets, if there is one.
tl::unexpected<Error> refused(const UrdfText& text, const std::string& file,
                              const std::vector<std::string>& said) {
  const std::string reason = said.empty() ? "not a URDF" : printable(said.front());
  for (const auto& joint : text.joints) {
    const std::string named = "[" + joint.name + "]";
    const auto names = [&](const std::string& message) {
      return message.find(named) != std::string::npos;
    };
    if (std::none_of(said.begin(), said.end(), names)) continue;
    return file_error(Errc::kConfig, file, joint.line,
                      "joint " + quote(joint.name) + ": " + reason);
  }
  return fail(Errc::kConfig, file + ": " + reason);
}

}  // namespace

Result<UrdfJoints> read_urdf_joints(const UrdfText& text, const std::string& file) {
  static Mutex mutex;
  const Lock lock(mutex);
  const Listener listener;
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text.cleaned);
  if (!model) return refused(text, file, listener.said());
  // A link owns the links below it. Without this, destroying a long chain would recurse as deep.
  for (const auto& [name, link] : model->links_) link->child_links.clear();
  return model->joints_;
}

}  // namespace tfdude
