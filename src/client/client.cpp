#include "tfdude/client/client.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "runtime/after_wait.hpp"
#include "runtime/participant.hpp"

namespace tfdude {
namespace {

Result<StampedTransform> look_up(Lookups& lookups, std::string_view a, std::string_view b,
                                 const Query& query, Milliseconds wait) {
  if (wait > Milliseconds(0)) return lookups.wait(a, b, query, wait);
  return lookups.lookup(a, b, query);
}

// A call that follows has the right error if it does not come, or nobody who owns it.
void await_frame(Participant& participant, const std::string& id, const Deadline& deadline) {
  if (deadline.over()) return;
  (void)participant.lookups().wait(id, id, {}, deadline.left());
  const auto info = participant.queries().info(id, deadline);
  const auto path = info ? participant.queries().path(info->parent, id, deadline)
                         : Result<std::vector<PathSegment>>();
  if (!path || path->empty()) return;
  participant.discovery().wait_for_partition(path->front().partition, deadline);
}

template <class Call>
auto after_wait_for(Participant& participant, const std::string& partition, Milliseconds wait,
                    Call call) {
  const auto ready = [&](Milliseconds left) {
    participant.discovery().wait_for_partition(partition, Deadline(left));
    return Result<void>();
  };
  return after_wait(participant.lookups(), wait, ready, call);
}

Result<JointUpdate> joint_update(const std::vector<std::string>& names,
                                 const std::vector<double>& positions,
                                 const std::vector<double>& variances, std::optional<Time> stamp) {
  if (positions.size() != names.size() ||
      (!variances.empty() && variances.size() != names.size())) {
    return fail(Errc::kInvalidInput, std::to_string(names.size()) + " joints, but " +
                                         std::to_string(positions.size()) + " positions and " +
                                         std::to_string(variances.size()) + " variances");
  }
  JointUpdate update{{}, stamp};
  for (std::size_t i = 0; i < names.size(); ++i) {
    update.joints.push_back({names[i], positions[i]});
    if (!variances.empty()) update.joints.back().variance = variances[i];
  }
  return update;
}

Result<void> check_follow(const ClientOptions& options) {
  if (!options.follow) return {};
  for (const std::string& one : *options.follow) {
    if (auto ok = check_id(one, "follow"); !ok) return ok;
  }
  if (options.follow->size() <= kMaxItems) return {};
  return fail(Errc::kInvalidInput, "follow has " + std::to_string(options.follow->size()) +
                                       " entries, of at most " + std::to_string(kMaxItems));
}

}  // namespace

Client::Client(std::unique_ptr<Participant> participant) : participant_(std::move(participant)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;
void Client::end_waits() { participant_->end_waits(); }

Result<Client> Client::open(const ClientOptions& options) {
  if (auto ok = check_follow(options); !ok) return tl::unexpected(std::move(ok.error()));
  auto transport = make_fastdds_transport(
      {options.domain, options.profile, {}, nullptr, options.discovery_server, options.keys});
  if (!transport) return tl::unexpected(std::move(transport.error()));
  return open(*std::move(transport), options);
}

Result<Client> Client::open(TransportPtr transport, const ClientOptions& options) {
  if (auto ok = check_follow(options); !ok) return tl::unexpected(std::move(ok.error()));
  auto participant = std::make_unique<Participant>(std::move(transport), std::string(), options);
  if (auto started = participant->start(); !started)
    return tl::unexpected(std::move(started.error()));
  return Client(std::move(participant));
}

Result<void> Client::add(const std::string& id, const std::string& parent, const Transform& X_PC,
                         const std::string& partition) {
  return participant_->writes().add(id, {parent, X_PC}, partition);
}

Result<void> Client::remove(const std::string& id) { return participant_->writes().remove(id); }
Result<void> Client::forget(const std::string& partition) {
  return participant_->writes().forget(partition);
}

Result<void> Client::update(const std::string& id, const Transform& X_PC,
                            const std::optional<Time>& stamp) {
  auto updated = participant_->forest().update(id, X_PC, stamp);
  if (updated || !Writes::is_elsewhere(updated.error())) return updated;
  return participant_->writes().update({{id, X_PC}}, stamp);
}

Result<void> Client::update(Handle frame, const Transform& X_PC, const std::optional<Time>& stamp) {
  if (auto updated = participant_->forest().update(frame, X_PC, stamp);
      updated || !Writes::is_elsewhere(updated.error())) {
    return updated;
  }
  const auto info = participant_->forest().info(frame);
  if (!info) {
    return fail(Errc::kUnknownFrame,
                "the frame of this handle was removed, or is another client's");
  }
  return participant_->writes().update({{info->id, X_PC}}, stamp);
}

Result<void> Client::update(const std::vector<EdgeUpdate>& edges,
                            const std::optional<Time>& stamp) {
  return participant_->writes().update(edges, stamp);
}

Result<void> Client::update(const std::vector<HandleUpdate>& edges,
                            const std::optional<Time>& stamp) {
  auto updated = participant_->forest().update(edges, stamp);
  if (updated || !Writes::is_elsewhere(updated.error())) return updated;
  std::vector<EdgeUpdate> named;
  for (const HandleUpdate& edge : edges) {
    const auto info = participant_->forest().info(edge.frame);
    if (!info)
      return fail(Errc::kUnknownFrame, "the frame of a handle was removed, or is another client's");
    named.push_back({info->id, edge.X_PC});
  }
  return participant_->writes().update(named, stamp);
}

Result<void> Client::update_partial(const std::vector<PartialUpdate>& edges,
                                    std::optional<Time> stamp) {
  return participant_->writes().update_partial(edges, stamp);
}

Result<void> Client::rewrite(const std::string& id, const TimeInterval& interval,
                             const std::vector<EdgeSample>& samples) {
  return participant_->writes().rewrite(id, interval, samples);
}

Result<void> Client::publish(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  return participant_->writes().publish(edges, stamp);
}

Result<EdgeStream> Client::stream(const std::vector<std::string>& edges) {
  return participant_->streams()
      .and_then([&](Streams* streams) { return streams->edges(edges); })
      .map([](std::shared_ptr<Sender<Update>> sender) { return EdgeStream(std::move(sender)); });
}

Result<JointStream> Client::stream_joints(const std::vector<std::string>& names) {
  return participant_->streams()
      .and_then([&](Streams* streams) { return streams->joints(names); })
      .map([](std::shared_ptr<Sender<JointUpdate>> sender) {
        return JointStream(std::move(sender));
      });
}

Result<void> Client::flush(Milliseconds wait) { return participant_->flush(wait); }

Result<void> Client::publish_joints(const std::vector<std::string>& names,
                                    const std::vector<double>& positions,
                                    const std::vector<double>& variances,
                                    std::optional<Time> stamp) {
  auto update = joint_update(names, positions, variances, stamp);
  if (!update) return tl::unexpected(std::move(update.error()));
  return participant_->joints().publish(*update);
}

Result<void> Client::publish_joints(std::vector<JointValue> joints, std::optional<Time> stamp) {
  return participant_->joints().publish({std::move(joints), stamp});
}

Result<void> Client::update_joints(const std::vector<std::string>& names,
                                   const std::vector<double>& positions,
                                   const std::vector<double>& variances,
                                   std::optional<Time> stamp) {
  auto update = joint_update(names, positions, variances, stamp);
  if (!update) return tl::unexpected(std::move(update.error()));
  return participant_->joints().update(*update);
}

Result<void> Client::update_joints(std::vector<JointValue> joints, std::optional<Time> stamp) {
  return participant_->joints().update({std::move(joints), stamp});
}

Result<std::vector<JointInfo>> Client::joints(const std::string& partition, Milliseconds wait) {
  return after_wait_for(*participant_, partition, wait,
                        [&] { return participant_->joints().list(partition); });
}

Result<ClockDifference> Client::clock_difference(const std::string& partition) {
  constexpr int kRoundTrips = 8;
  return participant_->queries().clock_difference(
      partition, participant_->discovery().call_deadline(), kRoundTrips);
}

Result<std::string> Client::description(const std::string& partition) {
  return participant_->descriptions().of(partition, participant_->discovery().call_deadline());
}

Result<void> Client::move(const std::string& id, const std::string& parent,
                          const PartialTransform& X_PC) {
  return participant_->writes().move(id, {parent, X_PC});
}

Result<void> Client::hand_over(const std::string& id, const std::string& partition) {
  return participant_->writes().hand_over(id, partition, std::nullopt, {});
}

Result<void> Client::hand_over(const std::string& id, const std::string& partition,
                               const std::string& parent, const PartialTransform& X_PC) {
  return participant_->writes().hand_over(id, partition, parent, X_PC);
}

Result<StampedTransform> Client::lookup(std::string_view a, std::string_view b, const Query& query,
                                        Milliseconds wait) {
  return look_up(participant_->lookups(), a, b, query, wait);
}

Result<StampedTransform> Client::lookup(Handle a, Handle b, const Query& query) {
  return participant_->lookups().lookup(a, b, query);
}

Result<StampedTransform> Client::lookup(std::string_view a, const Query& at_a, std::string_view b,
                                        const Query& at_b, std::string_view fixed,
                                        Milliseconds wait) {
  const auto ready = [&](Milliseconds left) {
    const Deadline deadline(left);
    auto found = participant_->lookups().wait(fixed, a, at_a, left);
    if (found) found = participant_->lookups().wait(fixed, b, at_b, deadline.left());
    return found;
  };
  return after_wait(participant_->lookups(), wait, ready, [&] {
    return participant_->two_instants().lookup(std::string(a), at_a, std::string(b), at_b,
                                               std::string(fixed),
                                               participant_->discovery().call_deadline());
  });
}

std::vector<Result<StampedTransform>> Client::lookup_many(const std::vector<FramePair>& pairs,
                                                          const Query& query, Milliseconds wait) {
  return participant_->many_lookups().lookup(pairs, query, wait);
}

std::vector<Result<StampedTransform>> Client::lookup_many(const std::string& a,
                                                          const std::vector<std::string>& frames,
                                                          const Query& query, Milliseconds wait) {
  std::vector<FramePair> pairs;
  pairs.reserve(frames.size());
  for (const std::string& frame : frames) pairs.push_back({a, frame});
  return lookup_many(pairs, query, wait);
}

Result<Trajectory> Client::trajectory(std::string_view a, std::string_view b,
                                      const std::vector<Time>& instants, const Query& query,
                                      Milliseconds wait) {
  return participant_->many_lookups().trajectory(a, b, instants, query, wait);
}

PendingLookup Client::lookup_async(const std::string& a, const std::string& b, const Query& query,
                                   Milliseconds wait, PendingLookup::Callback callback) {
  return PendingLookup(participant_->lookups().start(a, b, query, wait, std::move(callback)));
}

std::future<Result<StampedTransform>> Client::lookup_async(const std::string& a,
                                                           const std::string& b, const Query& query,
                                                           Milliseconds wait) {
  return participant_->lookups().start(a, b, query, wait);
}

Result<TransformedPoints> Client::transform(std::string_view a, std::string_view b,
                                            const std::vector<Point>& points_B, const Query& query,
                                            Milliseconds wait) {
  for (std::size_t i = 0; i < points_B.size(); ++i) {
    if (auto ok = check_point(points_B[i]); !ok) {
      return fail_at("point " + std::to_string(i) + " of frame " + quote(b), ok.error());
    }
  }
  const auto X_AB = look_up(participant_->lookups(), a, b, query, wait);
  if (!X_AB) return tl::unexpected(X_AB.error());
  return TransformedPoints{tfdude::transform(*X_AB, points_B, query.order), *X_AB};
}

Result<StampedTransform> Client::transform(std::string_view a, std::string_view b,
                                           const Transform& X_BC, const Query& query,
                                           Milliseconds wait) {
  if (auto finite = check_finite(X_BC); !finite) return tl::unexpected(finite.error());
  return look_up(participant_->lookups(), a, b, query, wait).map([&](StampedTransform X_AC) {
    const auto belief = [](const Transform& X) {
      return Belief{X.pose, X.covariance.of_specified(), {}, {}, !X.covariance.complete()};
    };
    static_cast<Transform&>(X_AC) = collapse(compose(belief(X_AC), belief(X_BC), query.order));
    return X_AC;
  });
}

Result<TransformedCloud<double>> Client::transform_cloud(
    std::string_view a, std::string_view b, const Eigen::Ref<const Eigen::Matrix3Xd>& points_B,
    const CloudQuery& query, Milliseconds wait) {
  return participant_->many_lookups().transform_cloud<double>(a, b, points_B, query, wait);
}

Result<TransformedCloud<float>> Client::transform_cloud(
    std::string_view a, std::string_view b, const Eigen::Ref<const Eigen::Matrix3Xf>& points_B,
    const CloudQuery& query, Milliseconds wait) {
  return participant_->many_lookups().transform_cloud<float>(a, b, points_B, query, wait);
}

Result<void> Client::can_lookup(std::string_view a, std::string_view b, const Query& query,
                                Milliseconds wait) {
  return look_up(participant_->lookups(), a, b, query, wait).map([](const StampedTransform&) {});
}

Explanation Client::why(const std::string& a, const std::string& b, const WhyQuery& query) {
  return participant_->explanations().why(a, b, query);
}

Result<PathWatch> Client::watch(const std::string& a, const std::string& b,
                                const WatchOptions& options, Milliseconds wait) {
  const auto ready = [&](Milliseconds left) {
    return participant_->lookups().wait(a, b, {}, left);
  };
  return after_wait(participant_->lookups(), wait, ready,
                    [&] { return participant_->watches().watch(a, b, options); })
      .map([](auto path) { return PathWatch(path); });
}

Result<EdgesWatch> Client::watch_edges(const std::vector<std::string>& ids,
                                       const WatchOptions& options, Milliseconds wait) {
  const auto ready = [&](Milliseconds left) {
    const Deadline deadline(left);
    for (const std::string& id : ids) await_frame(*participant_, id, deadline);
    return Result<void>();
  };
  return after_wait(participant_->lookups(), wait, ready,
                    [&] { return participant_->watches().watch_edges(ids, options); })
      .map([](auto edges) { return EdgesWatch(edges); });
}

Result<Velocity> Client::velocity(const std::string& a, const std::string& b,
                                  const VelocityQuery& query, Milliseconds wait) {
  const auto ready = [&](Milliseconds left) {
    Query then;
    then.at = query.at;
    return participant_->lookups().wait(a, b, then, left);
  };
  const auto call = [&] {
    return participant_->velocities().velocity(a, b, query,
                                               participant_->discovery().call_deadline());
  };
  // The newest interval ends later with each sample, so a history that has just begun will reach.
  const auto passes = [&](Errc code) {
    return may_return(code) || (code == Errc::kTooOld && !query.at);
  };
  return after_wait(participant_->lookups(), wait, ready, call, passes);
}

Result<Time> Client::now() {
  return participant_->clock().await(participant_->discovery().call_deadline());
}

Result<void> Client::wait_until(Time time, Milliseconds wait) {
  return participant_->clock().wait_until(time, Deadline(wait));
}

Result<void> Client::set_time(ExternalTime now) {
  return participant_->set_time(stamp_of(now), true);
}
Result<void> Client::publish_clock(ExternalTime now) {
  return participant_->publish_clock(stamp_of(now));
}
Result<void> Client::advance_to(ExternalTime time, Milliseconds wait) {
  return participant_->advance_to(stamp_of(time), Deadline(wait));
}

Result<PartitionWatch> Client::watch_partition(const std::string& partition,
                                               const PartitionWatchOptions& options) {
  return participant_->watches()
      .watch_partition(partition, options.rate, options.on_news)
      .map([](auto watched) { return PartitionWatch(std::move(watched)); });
}

Result<Observed> Client::observe(const std::string& a, const std::string& b, const Transform& X_AB,
                                 std::optional<Time> stamp, const ObserveOptions& options) {
  return participant_->observations().observe({a, b, X_AB, stamp, options},
                                              participant_->discovery().call_deadline());
}

Result<Observed> Client::determine(const std::string& id, const std::string& a,
                                   const std::string& b, const Transform& X_AB,
                                   std::optional<Time> stamp) {
  const Deadline deadline = participant_->discovery().call_deadline();
  return participant_->observations().determine(id, {a, b, X_AB, stamp, {1.0, true}}, deadline);
}

Result<Observed> Client::fuse(const std::string& id, const Transform& X_PC,
                              std::optional<Time> stamp, const ObserveOptions& options) {
  const Deadline deadline = participant_->discovery().call_deadline();
  const auto edge = participant_->queries().info(id, deadline);
  if (!edge) return tl::unexpected(edge.error());
  if (edge->parent.empty()) {
    return fail(Errc::kInvalidInput, "frame " + quote(id) + " is a root: it has no edge");
  }
  return participant_->observations().observe({edge->parent, id, X_PC, stamp, options}, deadline);
}

Result<void> Client::correlate(const std::string& id, const Correlation& correlation) {
  return participant_->writes().correlate(id, correlation);
}

Result<std::vector<EdgeConsistency>> Client::consistency(const std::string& partition) {
  return participant_->observations().consistency(partition);
}

Result<std::vector<HistoryInfo>> Client::history(const std::string& id, Milliseconds wait) {
  const auto ready = [&](Milliseconds left) {
    await_frame(*participant_, id, Deadline(left));
    return Result<void>();
  };
  return after_wait(participant_->lookups(), wait, ready,
                    [&] { return participant_->queries().history(id); });
}

Result<std::vector<HistoryInfo>> Client::histories(const std::string& partition,
                                                   Milliseconds wait) {
  return after_wait_for(*participant_, partition, wait,
                        [&] { return participant_->queries().histories(partition); });
}

Result<Pose> Client::lookup_pose(std::string_view a, std::string_view b) {
  return participant_->lookups().lookup_pose(a, b);
}

Result<Pose> Client::lookup_pose(Handle a, Handle b) {
  return participant_->lookups().lookup_pose(a, b);
}

Result<Handle> Client::find(std::string_view id) { return participant_->queries().find(id); }

Result<std::vector<PathSegment>> Client::path(std::string_view a, std::string_view b) {
  return participant_->queries().path(a, b);
}

Result<std::string> Client::parent(const std::string& id) {
  return participant_->queries().info(id).map([](const FrameInfo& info) { return info.parent; });
}

Result<std::vector<std::string>> Client::children(const std::string& id) {
  return participant_->queries().children(id);
}

Result<std::vector<std::string>> Client::roots() { return participant_->queries().roots(); }

bool Client::exists(const std::string& id) { return participant_->queries().info(id).has_value(); }

Result<bool> Client::whether_exists(const std::string& id) {
  const auto info = participant_->queries().info(id);
  if (info) return true;
  if (!is_unknown(info.error().code)) return tl::unexpected(info.error());
  const auto all = participant_->queries().partitions();
  if (!all) return tl::unexpected(all.error());
  if (all->empty()) return fail(Errc::kUnreachable, info.error().message);
  return false;
}

Result<std::vector<Frame>> Client::frames() { return participant_->queries().frames(); }

Result<std::vector<PartitionInfo>> Client::partitions() {
  auto partitions = participant_->queries().partitions();
  if (partitions) participant_->memory().tell(*partitions);
  return partitions;
}

void Client::find_memory() {
  // Which waits until they are known.
  if (participant_->queries().partitions()) participant_->memory().find_all();
}

Subscription Client::on_change(std::function<void(const Change&)> listener) {
  return Subscription(participant_->member().on_change(std::move(listener)));
}

}  // namespace tfdude
