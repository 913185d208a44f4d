#include "foxglove_talk.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "../rendering/json.hpp"
#include "foxglove_messages.hpp"
#include "foxglove_request.hpp"

namespace tfdude::web {
namespace {

using nlohmann::json;

// A client that has so much to take yet gets no picture.
constexpr std::size_t kFoxgloveBehind = std::size_t{1} << 20U;  // [B]
// Ellipsoids are as large as transforms and change less: every so many pictures.
constexpr int kSceneEvery = 6;

enum Channel : std::uint32_t { kTransforms = 1, kTf, kScene, kEvents, kFirstPair };

class FoxgloveTalk final : public Talk {
 public:
  explicit FoxgloveTalk(Live& live) : live_(live) { live_.count_viewer(1); }
  ~FoxgloveTalk() override { live_.count_viewer(-1); }
  FoxgloveTalk(const FoxgloveTalk&) = delete;
  FoxgloveTalk& operator=(const FoxgloveTalk&) = delete;

  void begin(Link& link) override {
    link_ = &link;
    tell({{"op", "serverInfo"},
          {"name", "tf-dude"},
          {"capabilities", json::array()},
          {"supportedEncodings", json::array()},
          {"metadata", json::object()},
          {"sessionId", std::to_string(nanoseconds(live_.now()))}});
    tell({{"op", "advertise"},
          {"channels",
           {foxglove::channel(kTransforms, "transforms", foxglove::kFrameTransforms),
            foxglove::channel(kTf, "/tf", foxglove::kTfMessage),
            foxglove::channel(kScene, "uncertainty", foxglove::kSceneUpdate),
            foxglove::channel(kEvents, "events", foxglove::kLog)}}});
  }

  bool receive(std::string_view message, bool binary) override {
    const auto request = foxglove::parse_client(message, binary);
    if (!request) return false;
    if (const auto* subscribe = std::get_if<foxglove::Subscribe>(&*request)) {
      for (const auto& [id, channel] : subscribe->subscriptions) add(id, channel);
    } else if (const auto* unsubscribe = std::get_if<foxglove::Unsubscribe>(&*request)) {
      for (const std::uint32_t id : unsubscribe->subscriptions) remove(id);
    } else {
      warn("not offered: " + std::get<foxglove::NotOffered>(*request).what);
    }
    return true;
  }

  void tick() override {
    if (link_->waiting() > kFoxgloveBehind) return;
    tell_pairs();
    send_transforms();
    send_scene();
    send_events();
  }

 private:
  void tell(const json& message) {
    link_->send(std::make_shared<const std::string>(cli::dump(message)), false);
  }
  void warn(const std::string& message) {
    tell({{"op", "status"}, {"level", 1}, {"message", message}});
  }

  void add(std::uint32_t id, std::uint32_t channel) {
    const bool exists = channel < kFirstPair ? channel >= kTransforms : pairs_.count(channel) > 0;
    if (!exists) return warn("there is no channel " + std::to_string(channel));
    // A copy of all that it is told for each would cost much, and clients take one for all.
    if (wanted(channel)) {
      return warn("channel " + std::to_string(channel) + " has a subscription already");
    }
    if (!subscriptions_.emplace(id, channel).second) {
      return warn("subscription " + std::to_string(id) + " exists");
    }
    // A new subscription gets the last value of each edge, also of static ones.
    if (channel == kTransforms || channel == kTf) seen_[channel] = 0;
    if (channel == kScene) scene_due_ = true;
    if (channel >= kFirstPair) pairs_.at(channel).number = 0;
  }

  void remove(std::uint32_t id) {
    if (subscriptions_.erase(id) == 0) warn("there is no subscription " + std::to_string(id));
  }

  [[nodiscard]] bool wanted(std::uint32_t channel) const {
    return std::any_of(subscriptions_.begin(), subscriptions_.end(),
                       [channel](const auto& one) { return one.second == channel; });
  }

  void send(std::uint32_t channel, Time time, const std::string& data) {
    for (const auto& [id, of] : subscriptions_) {
      if (of != channel) continue;
      link_->send(std::make_shared<const std::string>(foxglove::message_data(id, time, data)),
                  true);
    }
  }

  void send_transforms() {
    const Time now = live_.now();
    for (const std::uint32_t channel : {kTransforms, kTf}) {
      if (!wanted(channel)) continue;
      std::vector<foxglove::Edge> edges;
      live_.world().each_changed(seen_[channel], [&](const ShownFrame& frame) {
        edges.push_back({frame.parent, frame.id, frame.stamp.value_or(now), frame.pose});
      });
      seen_[channel] = live_.picture();
      if (edges.empty()) continue;
      send(channel, now,
           channel == kTf ? foxglove::tf_message(edges) : foxglove::frame_transforms(edges));
    }
  }

  void send_scene() {
    if (!wanted(kScene)) return;
    const bool all = live_.world().structure() != structure_ || scene_due_;
    if (!all && live_.picture() < scene_sent_ + kSceneEvery) return;
    structure_ = live_.world().structure();
    scene_sent_ = live_.picture();
    scene_due_ = false;
    std::map<std::uint32_t, std::string> roots;
    std::vector<foxglove::Ellipsoid> ellipsoids;
    live_.world().each_placed([&](const PlacedFrame& placed, std::uint32_t index) {
      if (placed.root == index) roots[index] = placed.frame->id;
      const auto& sigma = placed.X_RC.covariance.of_specified();
      if (!placed.known || (sigma.upper() == Covariance::Upper{})) return;
      ellipsoids.push_back({roots[placed.root], placed.frame->id, placed.X_RC});
    });
    send(kScene, live_.now(), foxglove::scene_update(ellipsoids, live_.now(), all));
  }

  void send_events() {
    const auto events = live_.events_after(event_);
    if (events.empty()) return;
    event_ = events.back().number;
    if (!wanted(kEvents)) return;
    for (const Event& event : events) {
      send(kEvents, event.time,
           foxglove::log_message(event.time, event.level == "warning",
                                 event.json.value("partition", ""),
                                 event.json.value("message", "")));
    }
  }

  // A channel for each pair that a page shows.
  void tell_pairs() {
    std::set<std::pair<std::string, std::string>> shown;
    live_.pairs().each([&](const Pair& pair) {
      shown.insert({pair.a(), pair.b()});
      const auto known = std::find_if(pairs_.begin(), pairs_.end(), [&](const auto& one) {
        return one.second.a == pair.a() && one.second.b == pair.b();
      });
      if (known == pairs_.end()) {
        pairs_[next_channel_] = {pair.a(), pair.b(), 0};
        const std::string topic = "pairs/" + pair.a() + "/" + pair.b();
        tell({{"op", "advertise"},
              {"channels", {foxglove::channel(next_channel_, topic, foxglove::kPairSchema)}}});
        ++next_channel_;
      } else if (known->second.number != pair.number() && wanted(known->first)) {
        known->second.number = pair.number();
        send(known->first, live_.now(), *pair.answer());
      }
    });
    for (auto known = pairs_.begin(); known != pairs_.end();) {
      if (shown.count({known->second.a, known->second.b}) > 0) {
        ++known;
        continue;
      }
      tell({{"op", "unadvertise"}, {"channelIds", {known->first}}});
      for (auto one = subscriptions_.begin(); one != subscriptions_.end();) {
        one = one->second == known->first ? subscriptions_.erase(one) : std::next(one);
      }
      known = pairs_.erase(known);
    }
  }

  struct PairChannel {
    std::string a;
    std::string b;
    std::uint64_t number = 0;  ///< of the answer that was sent last
  };

  Live& live_;
  Link* link_ = nullptr;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  // id: channel
  std::map<std::uint32_t, std::uint64_t> seen_;           // channel: picture
  std::map<std::uint32_t, PairChannel> pairs_;
  std::uint32_t next_channel_ = kFirstPair;
  std::uint32_t structure_ = 0;
  std::uint64_t scene_sent_ = 0;
  bool scene_due_ = false;
  std::uint64_t event_ = 0;
};

}  // namespace

std::unique_ptr<Talk> talk_to_foxglove(Live& live) { return std::make_unique<FoxgloveTalk>(live); }

}  // namespace tfdude::web
