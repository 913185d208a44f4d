#include "runtime/one_shots.hpp"

#include <algorithm>
#include <cstdint>
#include <set>
#include <utility>
#include <variant>

#include "base/mutex.hpp"
#include "runtime/member_runner.hpp"

namespace tfdude {

void OneShots::open() {
  const std::string network = context_.transport.network();
  if (network.empty() || !context_.options.shared_memory) return;
  socket_ = OneShotSocket::open(network, [this](std::string_view message) {
    const auto question = one_shot_question(message);
    const auto answered = question ? answer(*question) : std::nullopt;
    return answered ? one_shot_message(*answered) : std::string();
  });
}

// No error is an answer: the owners say over DDS why not.
std::optional<OneShotAnswer> OneShots::answer(const OneShotQuestion& question) {
  const Forest& forest = context_.structure.forest;
  // What has been changed here and is not stored may be lost.
  const std::uint64_t structure = forest.structure_version();
  if (context_.member.out() || !told()) return {};
  const auto segments = forest.segments(question.a, question.b);
  if (!segments) return {};
  if (segments->empty() && !exists(question.a)) return {};
  Query query;
  query.at = question.at;
  auto X_AB = memory_.lookup(question.a, question.b, query);
  if (!X_AB || X_AB->basis.bound) {
    // They will be asked over DDS now, and their memory can be read the next time.
    std::vector<Part> parts;
    for (const Segment& segment : *segments) parts.push_back({segment.owner, {}, {}});
    memory_.asked(parts);
    return {};
  }
  if (!none_assumed(X_AB->basis.unspecified)) return {};
  auto path = path_of(*segments);
  if (!path || forest.structure_version() != structure) return {};
  // Nobody here depends on owners that are asked for seldom, so that one hangs may not be known.
  const bool alive = std::all_of(path->begin(), path->end(), [&](const PathSegment& one) {
    return one.partition == context_.member.name() ||
           context_.transport.heard_lately(one.partition);
  });
  if (!alive) return {};
  return OneShotAnswer{*std::move(X_AB), *std::move(path)};
}

std::optional<std::vector<PathSegment>> OneShots::path_of(const std::vector<Segment>& segments) {
  Structure& structure = context_.structure;
  const Lock lock(structure.mutex);
  std::vector<PathSegment> path;
  for (const Segment& segment : segments) {
    const bool own = segment.owner == kHeldHere;
    const std::string& name = structure.directory.name(segment.owner);
    if (!own && !structure.directory.reachable(segment.owner)) return {};
    path.push_back({name, segment.from, segment.to,
                    own ? std::optional<ClockKind>(structure.clock.kind())
                        : structure.directory.info(segment.owner).clock});
  }
  return path;
}

// Which joints have had no sample, only their owner knows.
bool OneShots::none_assumed(const std::vector<std::string>& unspecified) {
  if (unspecified.empty()) return true;
  const std::set<std::string_view> edges(unspecified.begin(), unspecified.end());
  const bool own = std::all_of(edges.begin(), edges.end(), [&](std::string_view id) {
    return context_.structure.forest.holds(id);
  });
  if (!own) return false;
  const Reply reply = context_.member.answer(Request{0, context_.member.name(), JointsRequest{}});
  const auto* joints = std::get_if<std::vector<JointInfo>>(&reply.body);
  // There may be more of them.
  if (joints == nullptr || joints->size() >= kMaxItems) return false;
  return std::none_of(joints->begin(), joints->end(), [&](const JointInfo& joint) {
    return !joint.measured && edges.count(joint.frame) != 0;
  });
}

bool OneShots::exists(const std::string& id) {
  const auto frame = context_.structure.forest.info(id);
  if (!frame || frame->owner == kHeldHere) return frame.has_value();
  // The structure here may be behind that of the owner, which has the edge if there is the frame.
  return !frame->parent.empty() && answer({frame->parent, id, {}}).has_value();
}

bool OneShots::told() {
  return context_.member.with_rules([](const Member& member) { return member.told(); });
}

}  // namespace tfdude
