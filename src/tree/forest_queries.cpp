#include <algorithm>
#include <type_traits>
#include <utility>

#include "tfdude/base/id.hpp"

#include "tree/forest_impl.hpp"
#include "tree/remote_forest.hpp"

namespace tfdude {

Forest::Forest(Clock clock, std::shared_ptr<Arena> arena)
    : impl_(std::make_unique<Impl>(std::move(clock), std::move(arena))) {
  impl_->arena_->roots().layout = layout_hash();
}
Forest::~Forest() = default;

namespace {

// Calls visit(edge, from, to) for the edges from a to b, in order; an edge's version is that of its
// child.
template <class Visit>
Result<void> for_each_edge(const Ends& ends, Visit visit) {
  const Version* up = ends.a;
  const Version* down = ends.b;
  std::vector<const Version*> descent;  // the edges below the common ancestor towards b, from b
  while (up != down) {
    const bool from_a = up->depth >= down->depth;
    const Version*& here = from_a ? up : down;
    if (here->depth == 0) return not_connected(ends);
    const Version* parent = Frames::at(*here->above, ends.commit);
    if (from_a) {
      visit(*here, *here, *parent);
    } else {
      descent.push_back(here);
    }
    here = parent;
  }
  for (auto edge = descent.rbegin(); edge != descent.rend(); ++edge) {
    visit(**edge, *up, **edge);
    up = *edge;
  }
  return {};
}

}  // namespace

Result<Pose> Forest::lookup_pose(std::string_view a, std::string_view b) const {
  return impl_->paths().look_up_pose(a, b);
}
Result<Pose> Forest::lookup_pose(Handle a, Handle b) const {
  return impl_->paths().look_up_pose(a, b);
}
Result<StampedTransform> Forest::lookup(std::string_view a, std::string_view b,
                                        const Query& query) const {
  if (query.believed_at) return impl_->believed(a, b, query);
  return impl_->paths().look_up(a, b, query);
}
Result<StampedTransform> Forest::lookup(Handle a, Handle b, const Query& query) const {
  if (query.believed_at) return impl_->believed(a, b, query);
  return impl_->paths().look_up(a, b, query);
}

Result<std::vector<Segment>> Forest::segments(std::string_view a, std::string_view b) const {
  const epoch::Guard guard;
  const auto ends = impl_->frames_.ends(a, b);
  if (!ends) return tl::unexpected(ends.error());
  std::vector<Segment> runs;
  const auto append = [&runs](const Version& edge, const Version& from, const Version& to) {
    if (runs.empty() || runs.back().owner != edge.owner) {
      runs.push_back({edge.owner, std::string(from.name->text), {}});
    }
    runs.back().to = to.name->text;
  };
  if (auto ok = for_each_edge(*ends, append); !ok) return tl::unexpected(ok.error());
  return runs;
}

Result<std::vector<FrameInfo>> Forest::edges(std::string_view a, std::string_view b) const {
  const epoch::Guard guard;
  const auto ends = impl_->frames_.ends(a, b);
  if (!ends) return tl::unexpected(ends.error());
  std::vector<FrameInfo> all;
  const auto append = [&](const Version& edge, const Version&, const Version&) {
    all.push_back(impl_->frames_.info_of(edge, ends->commit));
  };
  if (auto ok = for_each_edge(*ends, append); !ok) return tl::unexpected(ok.error());
  return all;
}

std::optional<Handle> Forest::find(std::string_view id) const {
  const epoch::Guard guard;
  const Version* version = impl_->frames_.present(id, impl_->frames_.snapshot());
  if (version == nullptr) return std::nullopt;
  return Handle{version->slot, version->generation};
}

bool Forest::holds(std::string_view id) const {
  const epoch::Guard guard;
  const Version* version = impl_->frames_.named(id, impl_->frames_.snapshot());
  return version != nullptr && version->held();
}

std::optional<FrameInfo> Forest::info(std::string_view id) const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->frames_.snapshot();
  const Version* version = impl_->frames_.present(id, commit);
  if (version == nullptr) return std::nullopt;
  return impl_->frames_.info_of(*version, commit);
}

std::optional<FrameInfo> Forest::info(Handle frame) const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->frames_.snapshot();
  const Version* version = impl_->frames_.of(frame, commit);
  if (version == nullptr) return std::nullopt;
  return impl_->frames_.info_of(*version, commit);
}

Result<Transform> Forest::value(std::string_view id) const {
  const epoch::Guard guard;
  return impl_->frames_.held_value(id).map(
      [](const HeldVersion* edge) { return Impl::whole(*edge); });
}

std::vector<FrameInfo> Forest::frames() const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->frames_.snapshot();
  std::vector<FrameInfo> all;
  for (std::uint32_t slot = 0; slot < impl_->frames_.size(); ++slot) {
    const Version* version = impl_->frames_.at(slot, commit);
    if (version->present()) all.push_back(impl_->frames_.info_of(*version, commit));
  }
  return all;
}

std::vector<FrameInfo> Forest::subtree(std::string_view id) const {
  const Writing lock(impl_->mutex_);
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->frames_.snapshot();
  const Version* top = impl_->frames_.present(id, commit);
  std::vector<FrameInfo> all;
  if (top == nullptr) return all;
  for (const std::uint32_t slot : impl_->graph_.subtree(top->slot, [](auto) { return true; })) {
    all.push_back(impl_->frames_.info_of(impl_->frames_.newest(slot), commit));
  }
  return all;
}

Result<std::vector<std::string>> Forest::children(std::string_view id) const {
  const Writing lock(impl_->mutex_);
  const Version* version = impl_->frames_.newest_named(id);
  if (version == nullptr || !version->present()) {
    return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
  }
  std::vector<std::string> ids;
  impl_->graph_.for_each_child(version->slot, [&](std::uint32_t child) {
    ids.emplace_back(impl_->frames_.newest(child).name->text);
  });
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<std::string> Forest::roots() const {
  std::vector<std::string> ids;
  for (FrameInfo& frame : frames()) {
    if (!frame.attached) ids.push_back(std::move(frame.id));
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<FrameInfo> Forest::waiting_for(std::string_view id) const {
  const Writing lock(impl_->mutex_);
  const epoch::Guard guard;
  std::vector<FrameInfo> all;
  const Version* absent = impl_->frames_.newest_named(id);
  if (absent == nullptr || absent->present()) return all;
  impl_->graph_.for_each_child(absent->slot, [&](std::uint32_t child) {
    all.push_back(impl_->frames_.info_of(impl_->frames_.newest(child), impl_->frames_.snapshot()));
  });
  return all;
}

std::uint64_t Forest::newest_commit() const { return impl_->frames_.snapshot(); }

std::vector<ChangedEdge> Forest::changed(const CommitRange& commits) const {
  const epoch::Guard guard;
  std::vector<ChangedEdge> changed;
  for (std::uint32_t slot = 0; slot < impl_->frames_.size(); ++slot) {
    const Version* version = impl_->frames_.at(slot, commits.last);
    if (!version->held() || version->commit <= commits.after) continue;
    changed.push_back(Impl::kept(*static_cast<const HeldVersion*>(version)));
  }
  return changed;
}

std::uint64_t Forest::structure_version() const {
  return impl_->structure_version_.load(std::memory_order_acquire);
}

}  // namespace tfdude
