#include "runtime/participant.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "base/stamp.hpp"
#include "runtime/stream_links.hpp"

namespace tfdude {
namespace {

double seconds_of(Time time) { return static_cast<double>(nanoseconds(time)) * 1e-9; }

}  // namespace

Participant::Participant(TransportPtr transport, std::string partition, const Options& options)
    : options_(options),
      structure_(options.clock, partition),
      transport_(std::move(transport)),
      discovery_(structure_, *transport_, options.discovery, options.timeout),
      member_(structure_, *transport_, std::move(partition), parts()),
      requests_(structure_, discovery_, *transport_, *this, follow()),
      yielding_(structure_, requests_, member_, options.timeout),
      serving_(structure_, discovery_, *transport_, member_, options_),
      queries_(structure_, discovery_, requests_, member_, *transport_),
      writes_(structure_, discovery_, requests_, member_),
      joints_(structure_, discovery_, requests_, member_),
      observations_(structure_, discovery_, requests_),
      watcher_(
          structure_, discovery_, requests_, *transport_,
          [this] {
            return member_.with_rules(
                [](const Member& member) { return member.presence().incarnation; });
          },
          options.timeout),
      pushing_(structure_, *transport_, member_, watcher_, options.limits.watches),
      lookups_(structure_, discovery_, requests_, watcher_, options.timeout),
      velocities_(structure_, requests_, lookups_),
      descriptions_(requests_, options.description),
      streams_(edge_links(structure_, *transport_, member_),
               joint_links(structure_, *transport_, member_)) {
  const Lock lock(structure_.mutex);
  if (!wants_pages()) structure_.directory.do_without_pages();
}

MemberRunner::Parts Participant::parts() {
  return {[this] {
            watcher_.look_again();
            streams_.look_again();
            lookups_.look_again();
          },
          [this](const std::string& partition) { requests_.replies().on_lost(partition); },
          [this] { yielding_.ask(); }};
}

std::optional<Requests::Follow> Participant::follow() {
  if (!options_.follow) return std::nullopt;
  return Requests::Follow{*options_.follow, parts().on_routes};
}

// A stream learns of new owners by pages only.
Result<Streams*> Participant::streams() {
  if (auto ok = requests_.check_keeps_all("open streams"); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  return &streams_;
}

Reply Participant::answer_own(const Request& request) {
  auto reply = answer_query(request);
  return reply ? *std::move(reply) : member_.answer(request);
}

Participant::~Participant() {
  // Callbacks may use all other parts.
  lookups_.stop();
  member_.stop_events();
  streams_.stop();
  // The transport's threads use these until it has stopped.
  watcher_.stop();
  pushing_.stop();
  yielding_.stop();
  member_.stop();
  if (auto flushed = flush(std::min(options_.linger, options_.timeout)); !flushed) {
    log().warn("leaving: {}", flushed.error().message);
  }
  member_.say_goodbye();
  transport_->stop();
}

Result<void> Participant::serve(const std::vector<FrameSpec>& frames) {
  yielding_.start();
  return serving_.serve(frames);
}

Result<void> Participant::set_time(Time now, bool by_itself) {
  const auto before = structure_.clock.set(now);
  if (!before) return tl::unexpected(before.error());
  if (!*before) return {};
  const std::size_t cleared = structure_.forest.clear_histories(now, *before);
  // The 1st, 2nd, 4th... only: two publishers of the time would fill the log.
  const std::uint64_t jumps = ++jumps_;
  if ((jumps & (jumps - 1)) == 0) {
    // No surprise to who has set it back, and no harm where there is no history.
    const bool calm = by_itself || cleared == 0;
    log().log(calm ? spdlog::level::info : spdlog::level::warn,
              "the external clock jumped back from {} s to {} s (jump {}): the histories of {} "
              "edges are cleared",
              seconds_of(**before), seconds_of(now), jumps, cleared);
  }
  return {};
}

Result<void> Participant::publish_clock(Time now) {
  if (auto ok = check_stamp(now); !ok) return ok;
  if (wants_clock()) {
    if (auto set = set_time(now, true); !set) return set;
  }
  return transport_->publish_clock(now);
}

std::optional<Reply> Participant::answer_query(const Request& request) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return member_.partition()->answer_lookup(request.sequence, *lookup);
  }
  if (std::holds_alternative<HistoryRequest>(request.body)) {
    return member_.partition()->answer_history(request);
  }
  if (std::holds_alternative<WatchRequest>(request.body)) return pushing_.answer(request);
  if (std::holds_alternative<FramesRequest>(request.body)) return answer_frames(request);
  if (std::holds_alternative<DescriptionRequest>(request.body))
    return descriptions_.answer(request);
  return std::nullopt;
}

// What it does not know must not exist.
Reply Participant::answer_frames(const Request& request) {
  Reply reply{request.sequence, 0, Done{}};
  if (member_.out() || !discovery_.complete()) {
    reply.body = Error{Errc::kNotYet,
                       "partition " + quote(member_.name()) + " has not discovered all others yet"};
    return reply;
  }
  const Lock lock(structure_.mutex);
  auto known =
      known_frames(structure_.forest, structure_.directory, std::get<FramesRequest>(request.body));
  if (known) {
    reply.body = *std::move(known);
  } else {
    reply.body = std::move(known.error());
  }
  return reply;
}

RefusedCounts Participant::refused() {
  RefusedCounts counts;
  counts.watches = pushing_.refused();
  counts.dropped_samples = structure_.forest.dropped_samples();
  counts.messages = transport_->dropped();
  const Lock lock(structure_.mutex);
  if (const Partition* own = member_.partition()) counts.frames = own->refused_frames();
  return counts;
}

void Participant::on_request(const PeerId& from, const Request& request) {
  if (member_.partition() == nullptr) return;
  auto reply = answer_query(request);
  if (!reply) reply = member_.on_request(from, request);
  if (reply) transport_->reply(from, *reply);
}

void Participant::on_update(const Update& update) {
  if (Partition* own = member_.partition()) own->apply(update);
}

void Participant::on_pushed(const PushedValues& pushed) {
  if (watcher_.on_pushed(pushed)) lookups_.pushed();
}

bool Participant::owns_joint(std::string_view name) const {
  const Partition* own = member_.partition();
  return own != nullptr && own->moves(name);
}

bool Participant::owns_joints() const {
  const Partition* own = member_.partition();
  return own != nullptr && own->moves_any();
}

}  // namespace tfdude
