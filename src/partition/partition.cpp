#include "tfdude/partition/partition.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

}  // namespace

Partition::Partition(std::string name, std::uint64_t incarnation, Forest& forest,
                     Directory& directory)
    : name_(std::move(name)), forest_(forest), directory_(directory), pages_(name_, incarnation) {}

Result<void> Partition::load(const std::vector<FrameSpec>& frames) {
  std::vector<std::string> loaded;
  for (const FrameSpec& frame : frames) {
    auto added = forest_.add(frame.id, frame.parent, frame.X_PC, Forest::MissingParent::kAllow);
    if (!added) {
      for (const std::string& id : loaded) (void)forest_.remove(id);
      return added;
    }
    loaded.push_back(frame.id);
  }
  for (const FrameSpec& frame : frames) pages_.put(frame.id, frame.parent);
  pages_.close_epoch();
  return {};
}

Reply Partition::answer(const PeerId& peer, const Request& request) {
  if (std::holds_alternative<LookupRequest>(request.body)) return answer(request);
  if (auto before = replies_.find(peer, request.sequence)) return *std::move(before);
  Reply reply = answer(request);
  replies_.put(peer, reply);
  return reply;
}

Reply Partition::answer(const Request& request) {
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return answer_lookup(request.sequence, *lookup);
  }
  Reply reply;
  reply.sequence = request.sequence;
  if (auto done = apply(request); !done) reply.body = std::move(done.error());
  reply.epoch = pages_.epoch();
  return reply;
}

Reply Partition::answer_lookup(std::uint32_t sequence, const LookupRequest& lookup) const {
  Reply reply;
  reply.sequence = sequence;
  std::vector<Transform> transforms;
  transforms.reserve(lookup.segments.size());
  for (const PathEnds& segment : lookup.segments) {
    const auto X = forest_.lookup_segment(segment.from, segment.to);
    if (!X) {
      // Whatever is missing, the caller's picture of the structure is not (or no longer) the owner's.
      reply.body =
          Error{Errc::kNotOwner, "partition " + quote(name_) + " does not own the path from " +
                                     quote(segment.from) + " to " + quote(segment.to) + ": " +
                                     X.error().message};
      return reply;
    }
    transforms.push_back(*X);
  }
  reply.body = std::move(transforms);
  return reply;
}

Result<void> Partition::apply(const Request& request) {
  return std::visit(
      Overloaded{[&](const AddRequest& add_request) { return add(request.id, add_request); },
                 [&](const RemoveRequest& remove_request) { return remove(remove_request); },
                 [&](const UpdateRequest& update_request) { return update(update_request.edges); },
                 [&](const MoveRequest& move_request) { return move(request.id, move_request); },
                 [](const LookupRequest&) -> Result<void> { return {}; }},
      request.body);
}

Result<void> Partition::add(const std::string& id, const AddRequest& request) {
  auto added = forest_.add(id, request.parent, request.X_PC);
  if (!added) return added;
  pages_.put(id, request.parent);
  pages_.close_epoch();
  return {};
}

Result<void> Partition::remove(const RemoveRequest& request) {
  std::vector<std::string> removed;
  Result<void> outcome;
  for (const std::string& top : request.tops) {
    auto gone = forest_.remove(top);
    if (gone) {
      removed.insert(removed.end(), gone->begin(), gone->end());
    } else if (outcome) {
      outcome = tl::unexpected(at_home(std::move(gone.error()), top));
    }
  }
  for (const std::string& id : removed) {
    pages_.erase(id);
    directory_.released(id);
  }
  if (!removed.empty()) pages_.close_epoch();
  return outcome;
}

Result<void> Partition::move(const std::string& id, const MoveRequest& request) {
  if (auto moved = forest_.move(id, request.parent, request.X_PC); !moved) {
    return tl::unexpected(at_home(std::move(moved.error()), id));
  }
  pages_.put(id, request.parent);
  pages_.close_epoch();
  directory_.moved();
  return {};
}

Result<void> Partition::update(const std::vector<EdgeUpdate>& edges) {
  auto updated = forest_.update(edges);
  if (updated) return {};
  // It fails for nothing but a frame that is not held.
  const auto foreign = std::find_if(edges.begin(), edges.end(), [this](const EdgeUpdate& edge) {
    return !forest_.holds(edge.id);
  });
  return tl::unexpected(at_home(std::move(updated.error()), foreign->id));
}

std::size_t Partition::apply(const Update& update) {
  const auto owned = [this](const EdgeUpdate& edge) { return forest_.holds(edge.id); };
  if (std::all_of(update.edges.begin(), update.edges.end(), owned)) {
    if (forest_.update(update.edges)) return update.edges.size();
  }
  std::vector<EdgeUpdate> own;
  std::copy_if(update.edges.begin(), update.edges.end(), std::back_inserter(own), owned);
  return forest_.update(own) ? own.size() : 0;
}

// A frame asked of its owner that the owner does not have has moved on, or is gone: both are healed by
// a fresh look into the directory.
Error Partition::at_home(Error error, std::string_view id) const {
  if (error.code != Errc::kUnknownFrame && error.code != Errc::kNotOwner) return error;
  return {Errc::kNotOwner,
          "partition " + quote(name_) + " does not own frame " + quote(id) + " (any more)"};
}

}  // namespace tfdude
