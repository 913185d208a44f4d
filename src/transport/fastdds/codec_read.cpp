#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "math/flat.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/kinds.hpp"

// From what travels.
namespace tfdude::fastdds {
namespace {

std::string_view text(const wire::Id& id) { return {id.c_str(), id.size()}; }

Result<Transform> from_wire(const wire::Transform& in, std::string_view frame) {
  const auto pose =
      Pose::create(Eigen::Quaterniond(in[3], in[0], in[1], in[2]), {in[4], in[5], in[6]});
  if (!pose) return fail_at("frame " + quote(frame), pose.error());
  Covariance::Upper upper{};
  std::copy_n(in.begin() + 7, Covariance::kSize, upper.begin());
  const auto covariance = Covariance::from_upper(upper);
  if (!covariance) return fail_at("frame " + quote(frame), covariance.error());
  return Transform{*pose, *covariance};
}

Result<std::optional<Time>> stamp_from_wire(std::int64_t stamp, const char* field) {
  if (stamp < 0) {
    return fail(Errc::kInvalidInput,
                std::string(field) + " of " + std::to_string(stamp) + " ns is before 1970");
  }
  return stamp == 0 ? std::nullopt : std::optional<Time>(time_of(stamp));
}

Result<std::chrono::nanoseconds> duration_from_wire(std::int64_t duration, const char* field) {
  if (duration >= 0) return std::chrono::nanoseconds(duration);
  return fail(Errc::kInvalidInput,
              std::string(field) + " of " + std::to_string(duration) + " ns is negative");
}

Result<EdgeUpdate> edge_from_wire(std::string_view id, const wire::Transform& x_pc) {
  if (auto ok = check_id(id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  auto X_PC = from_wire(x_pc, id);
  if (!X_PC) return tl::unexpected(std::move(X_PC.error()));
  return EdgeUpdate{std::string(id), *X_PC};
}

Result<UpdateRequest> update_from_wire(std::string_view first, const wire::UpdateBody& body) {
  UpdateRequest update;
  auto stamp = stamp_from_wire(body.stamp(), "a stamp");
  if (!stamp) return tl::unexpected(std::move(stamp.error()));
  update.stamp = *stamp;
  update.edges.reserve(1 + body.more().size());
  auto edge = edge_from_wire(first, body.x_pc());
  if (!edge) return tl::unexpected(std::move(edge.error()));
  update.edges.push_back(*std::move(edge));
  for (const wire::Edge& more : body.more()) {
    edge = edge_from_wire(text(more.id()), more.x_pc());
    if (!edge) return tl::unexpected(std::move(edge.error()));
    update.edges.push_back(*std::move(edge));
  }
  return update;
}

std::string string_of(const wire::Id& id) { return std::string(text(id)); }

std::vector<PathEnds> read_segments(const std::vector<wire::PathEnds>& body) {
  std::vector<PathEnds> segments;
  segments.reserve(body.size());
  for (const wire::PathEnds& ends : body) {
    segments.push_back({string_of(ends.from()), string_of(ends.to())});
  }
  return segments;
}

Result<LookupRequest> read_lookup(const wire::LookupAt& body) {
  const auto at = stamp_from_wire(body.at(), "the instant of a lookup");
  if (!at) return tl::unexpected(at.error());
  const auto hint = stamp_from_wire(body.hint(), "the hint of a lookup");
  if (!hint) return tl::unexpected(hint.error());
  const auto until = stamp_from_wire(body.age_noise_until(), "the end of a lookup's noise");
  if (!until) return tl::unexpected(until.error());
  const auto extrapolate = duration_from_wire(body.extrapolate(), "an extrapolation");
  if (!extrapolate) return tl::unexpected(extrapolate.error());
  return LookupRequest{read_segments(body.segments()), {*at, *extrapolate, *until}, *hint};
}

Result<WatchRequest> read_watch(const wire::Watch& body) {
  const auto period = duration_from_wire(body.period(), "the period of a watch");
  if (!period) return tl::unexpected(period.error());
  WatchRequest watch;
  for (const wire::Id& edge : body.edges()) watch.edges.push_back(string_of(edge));
  watch.segments = read_segments(body.segments());
  watch.period = *period;
  return watch;
}

// The ids in a body need no check here: those that name nothing that is there are refused as unknown, and
// new ones are checked where they are added.
Result<void> read_body(const wire::Request& sample, Request& request) {
  const wire::RequestBody& body = sample.body();
  switch (body._d()) {
    case kAdd: {
      auto X_PC = from_wire(body.add().x_pc(), request.id);
      if (!X_PC) return tl::unexpected(std::move(X_PC.error()));
      request.body = AddRequest{string_of(body.add().parent()), *X_PC};
      return {};
    }
    case kRemove: {
      RemoveRequest remove;
      for (const wire::Id& top : body.remove().tops()) remove.tops.push_back(string_of(top));
      request.body = std::move(remove);
      return {};
    }
    case kUpdate: {
      auto update = update_from_wire(request.id, body.update());
      if (!update) return tl::unexpected(std::move(update.error()));
      request.body = *std::move(update);
      return {};
    }
    case kMove:
      request.body = MoveRequest{string_of(body.move().parent()), std::nullopt};
      return {};
    case kMoveAndUpdate: {
      auto X_PC = from_wire(body.move_and_update().x_pc(), request.id);
      if (!X_PC) return tl::unexpected(std::move(X_PC.error()));
      request.body = MoveRequest{string_of(body.move_and_update().parent()), *X_PC};
      return {};
    }
    case kLookup:
      request.body = LookupRequest{read_segments(body.lookup())};
      return {};
    case kLookupAt: {
      auto lookup = read_lookup(body.lookup_at());
      if (!lookup) return tl::unexpected(std::move(lookup.error()));
      request.body = *std::move(lookup);
      return {};
    }
    case kWatch: {
      auto watch = read_watch(body.watch());
      if (!watch) return tl::unexpected(std::move(watch.error()));
      request.body = *std::move(watch);
      return {};
    }
    case kPast:
      request.body = PastRequest{body.past() != 0};
      return {};
    default:
      return fail(Errc::kInvalidInput, "no request of kind " + std::to_string(body._d()));
  }
}

}  // namespace

Result<Request> from_wire(const wire::Request& sample) {
  Request request;
  request.sequence = sample.sequence_number();
  request.id = string_of(sample.id());
  if (auto ok = check_id(request.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  if (auto ok = read_body(sample, request); !ok) return tl::unexpected(std::move(ok.error()));
  return request;
}

namespace {

Result<std::vector<Transform>> read_values(const std::vector<wire::Transform>& body) {
  std::vector<Transform> values;
  values.reserve(body.size());
  for (const wire::Transform& in : body) {
    auto X = computed_from(in);
    if (!X) return fail_at("a reply", X.error());
    values.push_back(*X);
  }
  return values;
}

Result<SegmentValues> read_stamped(const wire::Transforms& body) {
  SegmentValues found;
  const auto stamp = stamp_from_wire(body.stamp(), "the stamp of a reply");
  if (!stamp) return tl::unexpected(stamp.error());
  found.stamp = *stamp;
  found.period = std::chrono::nanoseconds(body.period());
  auto values = read_values(body.values());
  if (!values) return tl::unexpected(std::move(values.error()));
  found.values = *std::move(values);
  auto at_hint = read_values(body.at_hint());
  if (!at_hint) return tl::unexpected(std::move(at_hint.error()));
  found.at_hint = *std::move(at_hint);
  return found;
}

PastInfo read_past(const wire::Past& body) {
  const auto stamp = [](std::int64_t ns) {
    return ns > 0 ? std::optional<Time>(time_of(ns)) : std::nullopt;
  };
  PastInfo past;
  past.id = printable(text(body.id()));
  past.samples = body.samples();
  past.bytes = body.bytes();
  past.span_limit = std::chrono::nanoseconds(body.span_limit());
  past.count_limit = body.count_limit();
  past.oldest = stamp(body.oldest());
  past.newest = stamp(body.newest());
  past.mean_gap = std::chrono::nanoseconds(body.mean_gap());
  past.max_gap = std::chrono::nanoseconds(body.max_gap());
  past.jitter = std::chrono::nanoseconds(body.jitter());
  past.refused_old = body.refused_old();
  past.refused_equal = body.refused_equal();
  return past;
}

template <class Body, class Read>
Result<void> put(Reply& reply, Result<Read> read) {
  if (!read) return tl::unexpected(std::move(read.error()));
  reply.body = Body(*std::move(read));
  return {};
}

Result<void> read_body(const wire::ReplyBody& body, Reply& reply) {
  switch (body._d()) {
    case kError:
      // For people to read, though its sender may have put anything in it.
      reply.body = Error{static_cast<Errc>(body.error().code()), printable(body.error().message())};
      return {};
    case kTransforms:
      return put<SegmentValues>(reply, read_values(body.transforms()).map([](auto&& values) {
        return SegmentValues{std::move(values), std::nullopt, {}, {}};
      }));
    case kDoneReply:
      return {};
    case kStamped:
      return put<SegmentValues>(reply, read_stamped(body.stamped()));
    case kState:
      return put<State>(reply, tfdude::fastdds::from_wire(body.state()));
    case kPasts: {
      std::vector<PastInfo> pasts;
      for (const wire::Past& past : body.pasts()) pasts.push_back(read_past(past));
      reply.body = std::move(pasts);
      return {};
    }
    default:
      return fail(Errc::kInvalidInput, "no reply of kind " + std::to_string(body._d()));
  }
}

}  // namespace

Result<Reply> from_wire(const wire::Reply& sample) {
  Reply reply;
  reply.sequence = sample.sequence_number();
  reply.epoch = sample.epoch();
  if (auto ok = read_body(sample.body(), reply); !ok) return tl::unexpected(std::move(ok.error()));
  return reply;
}

Result<State> from_wire(const wire::State& sample) {
  State state;
  state.group = sample.group();
  state.entries.reserve(sample.entries().size());
  for (const wire::StateEntry& entry : sample.entries()) {
    const auto stamp = stamp_from_wire(entry.stamp(), "the stamp of a state");
    if (!stamp) return tl::unexpected(stamp.error());
    auto X = computed_from(entry.x());
    if (!X) return fail_at("a state", X.error());
    state.entries.push_back({entry.index(), *stamp, *X});
  }
  return state;
}

Result<Update> from_wire(const wire::Update& sample,
                         const std::function<bool(std::string_view)>& accept) {
  Update update;
  const auto stamp = stamp_from_wire(sample.stamp(), "the stamp of an update");
  if (!stamp) return tl::unexpected(stamp.error());
  update.stamp = *stamp;
  update.edges.reserve(sample.edges().size());
  for (const wire::Edge& edge : sample.edges()) {
    if (!accept(text(edge.id()))) continue;
    auto read = edge_from_wire(text(edge.id()), edge.x_pc());
    if (!read) return tl::unexpected(std::move(read.error()));
    update.edges.push_back(*std::move(read));
  }
  return update;
}

namespace {

Result<Note> read_note(const wire::Note& sample) {
  constexpr auto kLast = static_cast<std::uint8_t>(Note::Kind::kUnhung);
  if (sample.kind() < 1 || sample.kind() > kLast) {
    return fail(Errc::kInvalidInput, "kind " + std::to_string(sample.kind()) + " of a note");
  }
  Note note{string_of(sample.id()), sample.since(), static_cast<Note::Kind>(sample.kind()),
            string_of(sample.rival())};
  if (auto ok = check_id(note.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  if (!note.rival.empty()) {
    if (auto ok = check_partition_name(note.rival); !ok) return tl::unexpected(ok.error());
  }
  return note;
}

}  // namespace

Result<Page> from_wire(const wire::Page& sample) {
  Page page{string_of(sample.partition()),
            sample.number(),
            sample.incarnation(),
            sample.epoch(),
            {},
            {},
            {}};
  if (auto ok = check_partition_name(page.partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  page.entries.reserve(sample.entries().size());
  for (const wire::PageEntry& entry : sample.entries()) {
    PageEntry read{string_of(entry.id()), string_of(entry.parent()), entry.since()};
    if (auto ok = check_id(read.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
    if (!read.parent.empty()) {
      if (auto ok = check_id(read.parent, "parent"); !ok)
        return tl::unexpected(std::move(ok.error()));
    }
    page.entries.push_back(std::move(read));
  }
  page.notes.reserve(sample.notes().size());
  for (const wire::Note& note : sample.notes()) {
    auto read = read_note(note);
    if (!read) return tl::unexpected(std::move(read.error()));
    page.notes.push_back(*std::move(read));
  }
  for (const wire::PageEpoch& one : sample.others()) {
    page.others.push_back({one.number(), one.epoch()});
  }
  return page;
}

Result<Presence> from_wire(const wire::Presence& sample) {
  Presence presence{string_of(sample.partition()),
                    sample.incarnation(),
                    std::string(sample.host().c_str()),
                    sample.pid(),
                    sample.pages(),
                    sample.serving(),
                    {}};
  if (auto ok = check_partition_name(presence.partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  if (auto ok = check_id(presence.host, "host"); !ok) return tl::unexpected(std::move(ok.error()));
  for (const wire::Absent& one : sample.absent()) {
    presence.absent.push_back({string_of(one.partition()), one.since()});
    if (auto ok = check_partition_name(presence.absent.back().partition); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
  }
  return presence;
}

}  // namespace tfdude::fastdds
