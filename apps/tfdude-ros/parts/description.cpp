#include "description.hpp"

#include <fstream>
#include <sstream>
#include <utility>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"

namespace tfdude::ros {

Result<void> DescriptionIn::start(RosDomain& domain, const IsNeighbour& is_own) {
  return domain.subscribe(
      description_topic(), [this, is_own](Message&& message, const Source& source) {
        if (source.bridge && is_own(*source.bridge)) return;
        worker_.post([this, text = std::get<Text>(std::move(message)).data] { take(text); });
      });
}

void DescriptionIn::stop() {
  worker_.stop();
  node_.reset();
}

bool DescriptionIn::wait_until_served(std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(mutex_);
  return changed_.wait_for(lock, patience, [this] { return served_; });
}

void DescriptionIn::take(const std::string& text) {
  if (text == text_) return;
  const auto frames = parse_urdf(text, settings_.part);
  if (!frames) {
    spdlog::error("not served: {}", frames.error().message);
    return;
  }
  node_.reset();
  text_.clear();
  auto node = Node::open(settings_.partition, *frames, options_);
  if (!node) {
    spdlog::error("partition {}: {}", quote(settings_.partition), node.error().message);
    return;
  }
  node_.emplace(*std::move(node));
  text_ = text;
  spdlog::info("serving the robot of {} as partition {}: frames={}", settings_.part.file,
               quote(settings_.partition), node_->own_frames());
  const std::lock_guard<std::mutex> lock(mutex_);
  served_ = true;
  changed_.notify_all();
}

Result<std::unique_ptr<Publisher>> publish_description(RosDomain& domain, const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf())) return fail(Errc::kConfig, file + ": cannot be read");
  // A file that no daemon could serve is a mistake.
  if (const auto frames = load_urdf(UrdfPart{file}); !frames) {
    return tl::unexpected(frames.error());
  }
  auto publisher = domain.advertise(description_topic());
  if (publisher && !(*publisher)->publish(Text{text.str()})) {
    return fail(Errc::kTransport, file + ": DDS did not take the description");
  }
  return publisher;
}

}  // namespace tfdude::ros
