#include "frames_in.hpp"

#include <utility>

#include <spdlog/spdlog.h>

namespace tfdude::ros {

using Edit = TfImport::Edit;

Result<void> FramesIn::start(RosDomain& domain, const IsNeighbour& is_own) {
  for (const bool is_static : {false, true}) {
    auto take_message = [this, is_static, is_own](Message&& message, const Source& source) {
      if (source.bridge && is_own(*source.bridge)) return;
      worker_.post([this, is_static, writer = source.guid,
                    transforms = std::get<TfMessage>(std::move(message))] {
        take(transforms, writer, is_static);
      });
    };
    auto subscribed =
        domain.subscribe(is_static ? tf_static_topic() : tf_topic(), std::move(take_message));
    if (!subscribed) return subscribed;
  }
  return {};
}

void FramesIn::stop() {
  worker_.stop();
  const ImportCounts& counts = import_.counts();
  spdlog::info(
      "transforms of ROS: taken={} not taken: names={} values={} owned={} contested={} rejected={} "
      "timeless={} joined={}; of their stamps: {}; dropped messages={}",
      counts.taken, counts.names, counts.values, counts.owned, counts.contested, counts.rejected,
      counts.timeless, counts.joined, import_.stamps().summary(), worker_.dropped());
}

void FramesIn::on_change(const Change& change) {
  structure_.changed();
  const bool own = change.partition == node_.partition() && change.kind != ChangeKind::kConflict;
  if (own || retrying_.exchange(true)) return;
  worker_.post([this] {
    retrying_ = false;
    const std::lock_guard<std::mutex> lock(mutex_);
    apply(import_.retry(cli::Worker::Clock::now(),
                        [this](const std::string& id) { return structure_.holding(id); }));
  });
}

void FramesIn::hold(const TransformStamped& transform) {
  const std::lock_guard<std::mutex> lock(mutex_);
  apply(import_.hold(transform, cli::Worker::Clock::now(),
                     [this](const std::string& id) { return structure_.holding(id); }));
}

void FramesIn::place(const TransformStamped& transform) {
  const std::lock_guard<std::mutex> lock(mutex_);
  apply(import_.place(transform, cli::Worker::Clock::now(),
                      [this](const std::string& id) { return structure_.holding(id); }));
}

bool FramesIn::drop(const std::string& id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!import_.has_of_topic(id)) return true;
  const auto below = node_.children(id);
  if (below && !below->empty()) return false;
  const auto removed = node_.remove(id);
  if (!removed && removed.error().code != Errc::kUnknownFrame) return false;
  import_.forget(id);
  structure_.changed();
  return true;
}

void FramesIn::add_root(const std::string& id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto added = node_.add(id, {}, Transform(), node_.partition());
  if (!added && added.error().code != Errc::kAlreadyExists) rejected(id, added.error());
}

void FramesIn::give_up(std::set<std::string> frames) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto taken = import_.give_up(std::move(frames));
  if (taken.empty()) return;
  if (const auto released = node_.release(taken); !released) {
    spdlog::error("frames of /tf are not given up: {}", released.error().message);
  }
}

void FramesIn::take(const TfMessage& message, const std::string& writer, bool is_static) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto arrival = node_.now();
  apply(import_.take(
      message, writer, is_static, cli::Worker::Clock::now(),
      [this](const std::string& id) { return structure_.holding(id); },
      arrival ? std::optional<Time>(*arrival) : std::nullopt));
}

void FramesIn::apply(const TfImport::Changes& changes) {
  for (const std::string& report : changes.reports) spdlog::warn("{}", report);
  for (const Edit& edit : changes.edits) apply(edit);
  for (const TfImport::Batch& batch : changes.batches) apply(batch);
}

void FramesIn::apply(const Edit& edit) {
  const auto done = [&]() -> Result<void> {
    switch (edit.kind) {
      case Edit::Kind::kAddRoot:
        return node_.add(edit.id, {}, Transform(), node_.partition());
      case Edit::Kind::kAdd:
        return node_.add(edit.id, edit.parent, *edit.X_PC, node_.partition());
      case Edit::Kind::kClear:
        return node_.clear_history(edit.id);
      default:  // also to the same parent: without samples it is static
        return node_.move(edit.id, edit.parent, *edit.X_PC);
    }
  }()
                                 .and_then([&]() -> Result<void> {
                                   const auto timing = import_.timing_of(edit.id, timing_);
                                   const bool is_new = edit.kind == Edit::Kind::kAdd ||
                                                       edit.kind == Edit::Kind::kMove;
                                   return is_new && timing ? node_.set_timing(edit.id, *timing)
                                                           : Result<void>();
                                 });
  if (!done) rejected(edit.id, done.error());
}

// All of a batch at once; if one is rejected, each alone.
void FramesIn::apply(const TfImport::Batch& batch) {
  const auto done = node_.update(batch.edges, batch.stamp);
  if (done) return;
  for (const EdgeUpdate& edge : batch.edges) {
    const auto alone =
        batch.edges.size() == 1 ? done : node_.update(edge.id, edge.X_PC, batch.stamp);
    if (alone) continue;
    if (alone.error().code == Errc::kStampTaken && has(edge, batch.stamp)) {
      import_.repeated_alike();
    } else {
      log(import_.rejected_sample(edge.id, alone.error()));
    }
  }
}

bool FramesIn::has(const EdgeUpdate& edge, std::optional<Time> stamp) {
  constexpr double kRounding = 1e-12;
  const auto parent = node_.parent(edge.id);
  if (!parent) return false;
  Query query;
  query.at = stamp;
  const auto there = node_.lookup(*parent, edge.id, query);
  return there && there->pose.matrix().isApprox(edge.X_PC.pose.matrix(), kRounding);
}

void FramesIn::rejected(const std::string& id, const Error& error) {
  log(import_.rejected(id, error));
}

void FramesIn::log(const std::optional<std::string>& report) {
  if (report) spdlog::warn("{}", *report);
  structure_.changed();
}

}  // namespace tfdude::ros
