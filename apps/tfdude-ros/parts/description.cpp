#include "description.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"
#include "tfdude/description/config.hpp"

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
  auto frames = parse_urdf(text, settings_.part);
  if (!frames) {
    spdlog::error("not served: {}", frames.error().message);
    return;
  }
  node_.reset();
  const std::string former = std::exchange(text_, {});
  leave_root_to_tf(*frames);
  NodeOptions options = options_;
  options.description = text;
  auto node = Node::open(settings_.partition, *frames, options);
  if (!node) {
    spdlog::error("partition {}: {}", quote(settings_.partition), node.error().message);
    if (frames_in_ != nullptr) frames_in_->give_up({});
    // A robot that cannot be served does not take the place of one that can.
    if (!former.empty()) take(former);
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

// Where a robot stands is said on /tf, by odometry or localization: unless the configuration says
// it, its root link is a frame of /tf.
void DescriptionIn::leave_root_to_tf(std::vector<FrameSpec>& frames) {
  if (frames_in_ == nullptr) return;
  const auto root = std::find_if(frames.begin(), frames.end(),
                                 [](const FrameSpec& frame) { return frame.parent.empty(); });
  if (root != frames.end()) {
    frames_in_->add_root(root->id);
    frames.erase(root);
  }
  std::set<std::string> ids;
  for (const FrameSpec& frame : frames) ids.insert(frame.id);
  frames_in_->give_up(std::move(ids));
}

Result<void> DescriptionOut::start(RosDomain& domain) {
  auto publisher = domain.advertise(description_topic());
  if (!publisher) return tl::unexpected(std::move(publisher.error()));
  publisher_ = *std::move(publisher);
  if (settings_.file.empty()) return {};
  // A file that no daemon could serve is a mistake.
  Config served;
  if (auto read = add_urdf(served, UrdfPart{settings_.file}); !read) return read;
  return publish(served.robots.front());
}

void DescriptionOut::stop() {
  worker_.stop();
  publisher_ = nullptr;
}

void DescriptionOut::on_change(const Change& change) {
  if (change.kind == ChangeKind::kPartitionUp && change.partition == settings_.partition) {
    look();
  }
}

void DescriptionOut::look() {
  if (settings_.file.empty()) worker_.post([this] { ask(); });
}

Result<void> DescriptionOut::publish(const std::string& text) {
  if (publisher_->publish(Text{text})) return {};
  return fail(Errc::kTransport, "DDS did not take the description");
}

void DescriptionOut::ask() {
  const auto text = client_.description(settings_.partition);
  if (!text) {
    // The partition may appear later.
    if (text.error().code != Errc::kUnknownPartition) {
      spdlog::warn("no description of partition {}: {}", quote(settings_.partition),
                   text.error().message);
    }
    return;
  }
  if (text->empty()) {
    spdlog::warn("partition {} has no description: it serves no URDF, or more than one",
                 quote(settings_.partition));
    return;
  }
  if (*text == text_) return;
  if (const auto done = publish(*text); !done) {
    spdlog::error("{}", done.error().message);
    return;
  }
  text_ = *text;
  spdlog::info("publishing the description of partition {}: {} bytes", quote(settings_.partition),
               text_.size());
}

}  // namespace tfdude::ros
