#include "transport/fastdds/codec.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "math/flat.hpp"
#include "transport/fastdds/cdr_check.hpp"

namespace tfdude::fastdds {
namespace {

// The discriminators of wire::RequestBody and wire::ReplyBody.
enum RequestKind : std::uint8_t {
  kAdd = 1,
  kRemove = 2,
  kUpdate = 3,
  kMove = 4,
  kMoveAndUpdate = 5,
  kLookup = 6
};
enum ReplyKind : std::uint8_t { kError = 1, kTransforms = 2, kDoneReply = 3 };

constexpr std::size_t kMaxMessage = 4096;

std::string_view text(const wire::Id& id) { return {id.c_str(), id.size()}; }

wire::Transform to_wire(const Transform& X) { return to_flat(X); }

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

wire::Edge to_wire(const EdgeUpdate& edge) {
  wire::Edge out;
  out.id(edge.id);
  out.x_pc(to_wire(edge.X_PC));
  return out;
}

Result<EdgeUpdate> edge_from_wire(std::string_view id, const wire::Transform& x_pc) {
  if (auto ok = check_id(id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  auto X_PC = from_wire(x_pc, id);
  if (!X_PC) return tl::unexpected(std::move(X_PC.error()));
  return EdgeUpdate{std::string(id), *X_PC};
}

struct BodyWriter {
  wire::RequestBody& out;

  void operator()(const AddRequest& add) {
    wire::Add body;
    body.parent(add.parent);
    body.x_pc(to_wire(add.X_PC));
    out.add(std::move(body));
  }
  void operator()(const RemoveRequest& remove) {
    wire::Remove body;
    for (const std::string& top : remove.tops) body.tops().emplace_back(top);
    out.remove(std::move(body));
  }
  void operator()(const UpdateRequest& update) {
    wire::UpdateBody body;
    body.x_pc(to_wire(update.edges.front().X_PC));
    for (auto edge = update.edges.begin() + 1; edge != update.edges.end(); ++edge) {
      body.more().push_back(to_wire(*edge));
    }
    out.update(std::move(body));
  }
  void operator()(const MoveRequest& move) {
    if (move.X_PC) {
      wire::MoveAndUpdate body;
      body.parent(move.parent);
      body.x_pc(to_wire(*move.X_PC));
      out.move_and_update(std::move(body));
    } else {
      wire::Move body;
      body.parent(move.parent);
      out.move(std::move(body));
    }
  }
  void operator()(const LookupRequest& lookup) {
    std::vector<wire::PathEnds> body(lookup.segments.size());
    for (std::size_t i = 0; i < body.size(); ++i) {
      body[i].from(lookup.segments[i].from);
      body[i].to(lookup.segments[i].to);
    }
    out.lookup(std::move(body));
  }
};

Result<UpdateRequest> update_from_wire(std::string_view first, const wire::UpdateBody& body) {
  UpdateRequest update;
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
    case kLookup: {
      LookupRequest lookup;
      for (const wire::PathEnds& ends : body.lookup()) {
        lookup.segments.push_back({string_of(ends.from()), string_of(ends.to())});
      }
      request.body = std::move(lookup);
      return {};
    }
    default:
      return fail(Errc::kInvalidInput, "no request of kind " + std::to_string(body._d()));
  }
}

}  // namespace

void write_wire(const Request& request, std::string_view partition, wire::Request& sample) {
  sample.id(request.id);
  std::visit(BodyWriter{sample.body()}, request.body);
  sample.addressee(addressee_of(partition));
  sample.sequence_number(request.sequence);
}

wire::Request to_wire(const Request& request, std::string_view partition) {
  wire::Request sample;
  write_wire(request, partition, sample);
  return sample;
}

wire::Reply to_wire(const Reply& reply) {
  wire::Reply sample;
  sample.epoch(reply.epoch);
  sample.sequence_number(reply.sequence);
  if (const auto* error = std::get_if<Error>(&reply.body)) {
    wire::ErrorBody body;
    body.code(static_cast<std::uint8_t>(error->code));
    body.message(error->message.substr(0, kMaxMessage));
    sample.body().error(std::move(body));
  } else if (const auto* transforms = std::get_if<std::vector<Transform>>(&reply.body)) {
    std::vector<wire::Transform> body;
    body.reserve(transforms->size());
    for (const Transform& X : *transforms) body.push_back(to_wire(X));
    sample.body().transforms(std::move(body));
  } else {
    sample.body().done(0);
  }
  return sample;
}

wire::Update to_wire(const Update& update) {
  wire::Update sample;
  sample.edges().reserve(update.edges.size());
  for (const EdgeUpdate& edge : update.edges) sample.edges().push_back(to_wire(edge));
  return sample;
}

wire::Page to_wire(const Page& page) {
  wire::Page sample;
  sample.partition(page.partition);
  sample.number(page.number);
  sample.incarnation(page.incarnation);
  sample.epoch(page.epoch);
  sample.entries().resize(page.entries.size());
  for (std::size_t i = 0; i < page.entries.size(); ++i) {
    sample.entries()[i].id(page.entries[i].id);
    sample.entries()[i].parent(page.entries[i].parent);
    sample.entries()[i].since(page.entries[i].since);
  }
  sample.notes().resize(page.notes.size());
  for (std::size_t i = 0; i < page.notes.size(); ++i) {
    sample.notes()[i].id(page.notes[i].id);
    sample.notes()[i].since(page.notes[i].since);
    sample.notes()[i].kind(static_cast<std::uint8_t>(page.notes[i].kind));
    sample.notes()[i].rival(page.notes[i].rival);
  }
  sample.others().resize(page.others.size());
  for (std::size_t i = 0; i < page.others.size(); ++i) {
    sample.others()[i].number(page.others[i].number);
    sample.others()[i].epoch(page.others[i].epoch);
  }
  return sample;
}

wire::Presence to_wire(const Presence& presence) {
  wire::Presence sample;
  sample.partition(presence.partition);
  sample.incarnation(presence.incarnation);
  sample.host(presence.host);
  sample.pid(presence.pid);
  sample.pages(presence.pages);
  sample.serving(presence.serving);
  sample.absent().resize(presence.absent.size());
  for (std::size_t i = 0; i < presence.absent.size(); ++i) {
    sample.absent()[i].partition(presence.absent[i].partition);
    sample.absent()[i].since(presence.absent[i].since);
  }
  return sample;
}

Result<Request> from_wire(const wire::Request& sample) {
  Request request;
  request.sequence = sample.sequence_number();
  request.id = string_of(sample.id());
  if (auto ok = check_id(request.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  if (auto ok = read_body(sample, request); !ok) return tl::unexpected(std::move(ok.error()));
  return request;
}

Result<Reply> from_wire(const wire::Reply& sample) {
  Reply reply;
  reply.sequence = sample.sequence_number();
  reply.epoch = sample.epoch();
  const wire::ReplyBody& body = sample.body();
  if (body._d() == kError) {
    // For people to read, though its sender may have put anything in it.
    reply.body = Error{static_cast<Errc>(body.error().code()), printable(body.error().message())};
  } else if (body._d() == kTransforms) {
    std::vector<Transform> transforms;
    transforms.reserve(body.transforms().size());
    for (const wire::Transform& in : body.transforms()) {
      auto X = computed_from(in);
      if (!X) return fail_at("a reply", X.error());
      transforms.push_back(*X);
    }
    reply.body = std::move(transforms);
  } else if (body._d() != kDoneReply) {
    return fail(Errc::kInvalidInput, "no reply of kind " + std::to_string(body._d()));
  }
  return reply;
}

Result<Update> from_wire(const wire::Update& sample,
                         const std::function<bool(std::string_view)>& accept) {
  Update update;
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
