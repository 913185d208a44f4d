#include "runtime/participant.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "base/stamp.hpp"
#include "runtime/open_participants.hpp"

namespace tfdude {
namespace {

double seconds_of(Time time) { return static_cast<double>(nanoseconds(time)) * 1e-9; }

}  // namespace

Participant::Participant(TransportPtr transport, std::string partition,
                         const ParticipantOptions& options)
    : options_(options),
      process_memory_(ProcessMemory::open(options.shared_memory, !partition.empty())),
      structure_(options.clock, partition, process_memory_.arena),
      transport_(std::move(transport)),
      context_{options_, structure_, *transport_, discovery_, member_, requests_, threads_},
      discovery_(structure_, *transport_, options.discovery, options.timeout),
      member_(context_, std::move(partition), *this),
      requests_(structure_, discovery_, *transport_, *this, follow()),
      memory_(context_, process_memory_,
              {[this] { watches_.look_again(); }, [this] { return look_in_memory(); }}),
      one_shots_(context_, memory_),
      yielding_(context_),
      serving_(context_),
      queries_(context_),
      writes_(context_),
      joints_(context_),
      observations_(context_),
      watches_(context_, &memory_),
      watch_server_(context_, watches_),
      lookups_(context_, watches_, &memory_),
      velocities_(context_, lookups_),
      two_instants_(context_, lookups_),
      many_lookups_(context_, lookups_, two_instants_),
      explanations_(context_, lookups_, queries_, joints_),
      descriptions_(requests_, options.description),
      advances_(context_),
      streams_(context_) {
  const Lock lock(structure_.mutex);
  structure_.directory.limit_others(options_.others);
  if (!wants_pages()) structure_.directory.do_without_pages();
}

void Participant::on_routes() {
  memory_.look_again();
  watches_.look_again();
  streams_.look_again();
  lookups_.look_again();
}

std::optional<Requests::Follow> Participant::follow() {
  if (!options_.follow) return std::nullopt;
  return Requests::Follow{*options_.follow, [this] { on_routes(); }};
}

Loop::Clock::time_point Participant::look_in_memory() {
  const Watched::Looked looked = watches_.look();
  if (looked.is_new) lookups_.pushed();
  return looked.again;
}

// A stream learns of new owners by pages only.
Result<Streams*> Participant::streams() {
  if (auto ok = requests_.check_keeps_all("open streams"); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  return &streams_;
}

Reply Participant::answer_own(const Request& request) {
  auto reply = answer_query(request, std::nullopt);
  return reply ? *std::move(reply) : member_.answer(request);
}

Result<void> Participant::start() {
  auto started = transport_->start(*this);
  if (started) note_open(*this);
  return started;
}

Participant::~Participant() {
  note_ended(*this);
  end();
}

void Participant::end() {
  std::call_once(ended_, [this] { stop(); });
}

void Participant::end_waits() {
  lookups_.stop();
  watches_.end_waits();
  structure_.clock.end_waits();
  discovery_.end_waits();
}

void Participant::stop() {
  // Callbacks may use all other parts, but wait no longer.
  end_waits();
  one_shots_.stop();
  memory_.stop();
  member_.stop_events();
  threads_.callbacks.stop();
  streams_.stop();
  // The transport's threads use these until it has stopped.
  watches_.stop();
  watch_server_.stop();
  yielding_.stop();
  member_.stop();
  if (auto flushed = flush(std::min(options_.linger, options_.timeout)); !flushed) {
    log().warn("leaving: {}", flushed.error().message);
  }
  member_.say_goodbye();
  transport_->stop();
}

Result<void> Participant::serve(const std::vector<FrameSpec>& frames) {
  auto served = serving_.serve(frames);
  if (served) one_shots_.open();
  return served;
}

Result<void> Participant::clear_history(const std::string& id) {
  watch_server_.keep_pending();
  return forest().clear_history(id);
}

std::size_t Participant::clear_histories(Time from, std::optional<Time> jumped_from) {
  watch_server_.keep_pending();
  return forest().clear_histories(from, jumped_from);
}

Result<void> Participant::set_time(Time now, bool by_itself) {
  const auto before = structure_.clock.set(now);
  if (!before) return tl::unexpected(before.error());
  if (!*before) return {};
  const std::size_t cleared = clear_histories(now, *before);
  // Two publishers of the time would fill the log.
  const std::uint64_t jumps = ++jumps_;
  if (is_logged(jumps)) {
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

Result<void> Participant::advance_to(Time time, const Deadline& deadline) {
  if (auto sent = publish_clock(time); !sent) return sent;
  return advances_.await_others(time, deadline);
}

std::optional<Reply> Participant::answer_query(const Request& request,
                                               const std::optional<PeerId>& from) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return member_.partition()->answer_lookup(request.sequence, *lookup);
  }
  if (std::holds_alternative<HistoryRequest>(request.body)) {
    return member_.partition()->answer_history(request);
  }
  if (std::holds_alternative<WatchRequest>(request.body)) {
    return watch_server_.answer(request, from);
  }
  if (std::holds_alternative<FramesRequest>(request.body)) return answer_frames(request);
  if (std::holds_alternative<DescriptionRequest>(request.body))
    return descriptions_.answer(request);
  if (std::holds_alternative<MemoryRequest>(request.body)) {
    return memory_.answer(request, member_.incarnation());
  }
  if (std::holds_alternative<TimeRequest>(request.body)) return advances_.answer(request);
  return std::nullopt;
}

// What it does not know must not exist.
Reply Participant::answer_frames(const Request& request) {
  Reply reply{request.sequence, 0, Done{}};
  if (member_.out() || !discovery_.complete() || discovery_.ended_unaware()) {
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

bool Participant::responds(Milliseconds wait) {
  return transport_->busy_for() < wait && member().responds(Deadline(wait));
}

RefusedCounts Participant::refused() {
  RefusedCounts counts;
  counts.watches = watch_server_.refused();
  counts.dropped_samples = structure_.forest.dropped_samples();
  counts.messages = transport_->dropped();
  counts.datagrams = transport_->refused_datagrams();
  const Lock lock(structure_.mutex);
  counts.structure = structure_.directory.refused();
  if (const Partition* own = member_.partition()) counts.frames = own->refused_frames();
  return counts;
}

void Participant::on_request(const PeerId& from, const Request& request) {
  if (member_.partition() == nullptr) return;
  auto reply = answer_query(request, from);
  if (!reply) reply = member_.on_request(from, request);
  if (reply) transport_->reply(from, *reply);
}

void Participant::on_update(const Update& update) {
  if (Partition* own = member_.partition()) own->apply(update);
}

void Participant::on_pushed(const PushedValues& pushed) {
  if (watches_.on_pushed(pushed)) lookups_.pushed();
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
