#include "recorded_view.hpp"

#include <algorithm>
#include <deque>
#include <utility>
#include <variant>

#include "../rendering/json.hpp"
#include "told.hpp"
#include "world.hpp"

namespace tfdude::web {
namespace {

constexpr std::size_t kMostEvents = 300;  // as many as the page lists

std::size_t frames_in(const std::vector<PartitionNews>& state) {
  std::size_t count = 0;
  for (const PartitionNews& news : state) {
    const auto* frames = std::get_if<FramesNews>(&news.what);
    if (frames != nullptr) count += frames->frames.size();
  }
  return count;
}

}  // namespace

Result<RecordedView> RecordedView::of(Result<Recording> recording) {
  if (!recording) return tl::unexpected(std::move(recording.error()));
  RecordingSummary summary = recording->summary();
  if (!summary.start || !summary.end) return fail(Errc::kConfig, "nothing was recorded in it");
  return RecordedView(*std::move(recording), std::move(summary));
}

Result<RecordedView> RecordedView::open(const std::string& file) {
  auto view = of(Recording::open(file));
  if (view) return view;
  // The page knows its file by another name.
  Error error = std::move(view.error());
  const std::string name = "'" + file + "'";
  const std::size_t place = error.message.find(name);
  if (place != std::string::npos) error.message.replace(place, name.size(), "the file");
  return tl::unexpected(std::move(error));
}

Result<RecordedView> RecordedView::read(std::string_view bytes) {
  return of(Recording::read(bytes));
}

std::vector<Told> RecordedView::begin() {
  std::deque<nlohmann::json> events;
  if (!summary_.foreign) {
    recording_.events(*summary_.start, [&](const Change& change) {
      events.push_back(event_json(cli::change_json(change), change.time, level_of(change.kind)));
      if (events.size() > kMostEvents) events.pop_front();
      return true;
    });
  }
  const nlohmann::json about{{"op", "recording"},
                             {"start", std::to_string(nanoseconds(*summary_.start))},
                             {"end", std::to_string(nanoseconds(*summary_.end))},
                             {"foreign", summary_.foreign},
                             {"finished", summary_.finished},
                             {"problems", summary_.problems}};
  const nlohmann::json list{{"op", "events"}, {"events", events}};
  return {{false, cli::dump(about)}, {false, cli::dump(list)}};
}

Result<std::vector<Told>> RecordedView::at(Time instant, const std::string& a,
                                           const std::string& b) {
  const Time shown = std::clamp(instant, *summary_.start, *summary_.end);
  recording_.seek(shown);
  const auto state = recording_.state();
  if (const std::size_t frames = frames_in(state); frames > kMostFrames) {
    return fail(Errc::kTooMuch, "the recording has " + std::to_string(frames) +
                                    " frames, and the page shows " + std::to_string(kMostFrames));
  }
  World world;
  for (const PartitionNews& news : state) world.receive(news);
  std::vector<Told> told;
  nlohmann::json structure = world.structure_json();
  structure.erase("version");
  if (std::string text = structure.dump(); text != structure_text_) {
    structure_text_ = std::move(text);
    structure["version"] = ++structure_;
    told.push_back({false, cli::dump(std::move(structure))});
  }
  world.number_structure(structure_);
  for (std::string& message : world.newest(shown)) told.push_back({true, std::move(message)});
  if (!a.empty()) {
    const auto path = recording_.path(a, b).value_or(std::vector<PathSegment>());
    const auto X_AB = recording_.lookup(a, b);
    told.push_back({false, pair_text(a, b, X_AB, path, true, {})});
  }
  if (std::string text = joints(); text != joints_) {
    joints_ = text;
    told.push_back({false, std::move(text)});
  }
  return told;
}

std::string RecordedView::joints() const {
  nlohmann::json all = nlohmann::json::array();
  for (const PartitionInfo& partition : recording_.partitions()) {
    const auto joints = recording_.joints(partition.name);
    if (!joints) continue;
    for (const JointInfo& joint : *joints) all.push_back(cli::joint_json(joint));
  }
  return cli::dump({{"op", "joints"}, {"joints", std::move(all)}});
}

}  // namespace tfdude::web
