#include "live.hpp"

#include <algorithm>
#include <cmath>

#include "../rendering/json.hpp"
#include "../rendering/quantities.hpp"
#include "told.hpp"

namespace tfdude::web {
namespace {

constexpr std::size_t kKeptEvents = 200;
constexpr std::chrono::milliseconds kJointsEvery{200};

// Two significant digits, so that a steady rate does not change.
double rounded(double rate) {
  if (rate <= 0) return 0;
  const double unit = std::pow(10.0, std::floor(std::log10(rate)) - 1);
  return std::round(rate / unit) * unit;
}

nlohmann::json rate_json(const HistoryInfo& history) {
  nlohmann::json json{{"hz", rounded(cli::rate_of(history))}};
  const std::uint64_t rejected = cli::rejected_of(history);
  if (rejected > 0) json["refused"] = rejected;
  return json;
}

}  // namespace

Result<std::unique_ptr<Live>> Live::open(const Options& options, double rate) {
  auto client = Client::open(options);
  if (!client) return tl::unexpected(client.error());
  // Completes discovery first, so that what exists already is no event.
  (void)client->partitions();
  return std::unique_ptr<Live>(new Live(*std::move(client), options.clock, rate));
}

Live::Live(Client client, ClockKind clock, double rate)
    : clock_(clock), rate_(rate), client_(std::move(client)), pairs_(client_, worker_, rate) {
  worker_.post([this] { follow_partitions(); });
  worker_.repeat(kJointsEvery, [this] {
    if (viewers_ > 0) ask_joints();
  });
  changes_ = client_.on_change([this](const Change& change) {
    add_event(change);
    const bool of_partition = change.frame.empty();
    if (of_partition) worker_.post([this] { follow_partitions(); });
  });
}

Live::~Live() {
  changes_ = Subscription();
  worker_.stop();
}

void Live::follow_partitions() {
  const auto partitions = client_.partitions();
  if (!partitions) return;
  std::set<std::string> there;
  nlohmann::json all = nlohmann::json::array();
  for (const PartitionInfo& partition : *partitions) {
    there.insert(partition.name);
    all.push_back(cli::partition_json(partition));
    if (watches_.count(partition.name) > 0 || !partition.compatible()) continue;
    PartitionWatchOptions options;
    options.rate = rate_;
    options.on_news = [this](const PartitionNews& news) { world_.receive(news); };
    auto watch = client_.watch_partition(partition.name, options);
    if (watch) watches_.emplace(partition.name, *std::move(watch));
  }
  for (auto watch = watches_.begin(); watch != watches_.end();) {
    if (there.count(watch->first) > 0) {
      ++watch;
      continue;
    }
    const std::string forgotten = watch->first;
    watch = watches_.erase(watch);
    world_.drop(forgotten);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  partitions_ = std::move(all);
}

void Live::ask_status() {
  const auto partitions = client_.partitions();
  if (!partitions) return;
  nlohmann::json edges = nlohmann::json::object();
  for (const PartitionInfo& partition : *partitions) {
    if (!partition.reachable || !partition.compatible()) continue;
    const auto histories = client_.histories(partition.name);
    if (!histories) continue;
    for (const HistoryInfo& history : *histories) {
      edges[history.id] = rate_json(history);
      note_rejected(partition.name, history);
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  nlohmann::json change{{"op", "status"}, {"edges", nlohmann::json::object()}};
  for (const auto& [id, rate] : edges.items()) {
    const auto before = edges_.find(id);
    if (before == edges_.end() || *before != rate) change["edges"][id] = rate;
  }
  change["partitions"] = partitions_;
  if (const auto span = world_.span()) {
    change["span"] = {std::to_string(nanoseconds(span->first)),
                      std::to_string(nanoseconds(span->second))};
  }
  edges_ = std::move(edges);
  change_ = {change_.first + 1, std::make_shared<const std::string>(cli::dump(change))};
}

void Live::ask_joints() {
  const auto partitions = client_.partitions();
  if (!partitions) return;
  nlohmann::json joints = nlohmann::json::array();
  for (const PartitionInfo& partition : *partitions) {
    if (!partition.reachable || !partition.compatible()) continue;
    const auto moved = client_.joints(partition.name);
    if (!moved) continue;
    for (const JointInfo& joint : *moved) joints.push_back(cli::joint_json(joint));
  }
  std::string text = cli::dump({{"op", "joints"}, {"joints", std::move(joints)}});
  const std::lock_guard<std::mutex> lock(mutex_);
  if (joints_.second && *joints_.second == text) return;
  joints_ = {joints_.first + 1, std::make_shared<const std::string>(std::move(text))};
}

void Live::note_rejected(const std::string& partition, const HistoryInfo& history) {
  const std::uint64_t rejected = cli::rejected_of(history);
  const auto [known, is_first] = rejected_.emplace(history.id, rejected);
  const std::uint64_t before = is_first ? 0 : known->second;
  known->second = rejected;
  if (rejected <= before) return;
  const std::string message = std::to_string(rejected - before) + " samples of '" + history.id +
                              "' were rejected by '" + partition + "' (" +
                              std::to_string(history.refused_old) + " too old, " +
                              std::to_string(history.refused_equal) + " of a taken stamp, " +
                              std::to_string(history.refused_ahead) + " too far ahead in all)";
  const auto now = client_.now();
  add_event({0,
             now ? *now : Time{},
             "warning",
             {{"event", "samples_rejected"},
              {"frame", history.id},
              {"partition", partition},
              {"message", message}}});
}

void Live::add_event(const Change& change) {
  add_event({0, change.time, level_of(change.kind), cli::change_json(change)});
}

void Live::add_event(Event event) {
  const std::lock_guard<std::mutex> lock(mutex_);
  event.number = ++last_event_;
  event.json = event_json(std::move(event.json), event.time, event.level);
  events_.push_back(std::move(event));
  if (events_.size() > kKeptEvents) events_.pop_front();
}

std::vector<Event> Live::events_after(std::uint64_t number) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<Event> events;
  for (const Event& event : events_) {
    if (event.number > number) events.push_back(event);
  }
  return events;
}

Text Live::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::make_shared<const std::string>(
      cli::dump({{"op", "status"}, {"edges", edges_}, {"partitions", partitions_}}));
}

std::pair<std::uint64_t, Text> Live::joints() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return joints_;
}

std::pair<std::uint64_t, Text> Live::status_change() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return change_;
}

void Live::tick() {
  picture_ = world_.end_picture();
  values_.clear();
  covariances_.clear();
  pairs_.tick();
  const auto a_second = static_cast<std::uint64_t>(std::max(1.0, std::round(rate_)));
  if (++ticks_ % a_second != 0) return;
  worker_.post([this] {
    follow_partitions();
    if (viewers_ > 0) ask_status();
  });
}

Text Live::structure() {
  const std::uint32_t version = world_.structure();
  if (!structure_.second || structure_.first != version) {
    structure_ = {version, std::make_shared<const std::string>(cli::dump(world_.structure_json()))};
  }
  return structure_.second;
}

Text Live::made_since(std::uint64_t picture, std::map<std::uint64_t, Text>& made,
                      std::string (World::*make)(std::uint64_t, Time) const) {
  const auto found = made.find(picture);
  if (found != made.end()) return found->second;
  std::string message = (world_.*make)(picture, now());
  return made[picture] =
             message.empty() ? nullptr : std::make_shared<const std::string>(std::move(message));
}

Text Live::values_since(std::uint64_t picture) {
  return made_since(picture, values_, &World::values_since);
}

Text Live::covariances_since(std::uint64_t picture) {
  return made_since(picture, covariances_, &World::covariances_since);
}

Time Live::now() {
  // The client would wait for an external clock that has no time yet.
  const auto now = clock_ == ClockKind::kSystem ? client_.now() : fail(Errc::kNotYet, "");
  if (now) return *now;
  const auto span = world_.span();
  return span ? span->second : Time{};
}

}  // namespace tfdude::web
