#include "tree/epoch.hpp"
#include "tree/forest_impl.hpp"
#include "tree/no_data.hpp"
#include "tree/path_walk.hpp"

// What was believed before.
namespace tfdude {

void Forest::Impl::remember(const EdgeTiming& timing) {
  if (timing.believed.count() == 0) return;
  if (past_ == nullptr) past_ = std::make_unique<Past>(frames_, reclaimer_.samples(), now_);
  past_->keep_for(timing.believed);
}

// Out of line: it is in each update.
[[gnu::noinline]] void Forest::Impl::remember_commit() {
  past_->commit(reclaimer_.superseded_held());
  keep_to_limit();
}

Result<std::vector<Ends>> Forest::Impl::go_back(
    std::optional<FormerEdges>& former, const Query& query, std::optional<Time> hint,
    const std::function<Result<std::vector<Ends>>()>& find) const {
  const Writing lock(mutex_);
  auto paths = find();
  if (!paths) return paths;
  auto taken = former.emplace().take(*paths, query, hint, past_.get(), now_);
  if (!taken) return tl::unexpected(std::move(taken.error()));
  return former->paths();
}

template <class Name>
Result<StampedTransform> Forest::Impl::believed(Name a, Name b, const Query& query) const {
  const epoch::Guard guard;
  OwnEdgesOnly own;
  // Whether the frames are connected, and others hold an edge: that counts more than what is kept.
  const auto find = [&]() -> Result<std::vector<Ends>> {
    const auto ends = frames_.ends(a, b);
    if (!ends) return tl::unexpected(ends.error());
    Pose newest;
    auto now = compute_newest(*ends, own, newest);
    const bool of_time =
        !now && (now.error().code == Errc::kNotYet || now.error().code == Errc::kTooOld);
    if (!now && !of_time) return tl::unexpected(std::move(now.error()));
    return std::vector<Ends>{*ends};
  };
  std::optional<FormerEdges> former;
  const auto paths = go_back(former, query, std::nullopt, find);
  if (!paths) return tl::unexpected(paths.error());
  Result<StampedTransform> X_AB;
  auto found = compute_queried(paths->front(), query, own, *X_AB);
  if (!found) X_AB = tl::unexpected(explained(std::move(found.error()), *paths, query, now_));
  return X_AB;
}

template Result<StampedTransform> Forest::Impl::believed(std::string_view a, std::string_view b,
                                                         const Query& query) const;
template Result<StampedTransform> Forest::Impl::believed(Handle a, Handle b,
                                                         const Query& query) const;

}  // namespace tfdude
