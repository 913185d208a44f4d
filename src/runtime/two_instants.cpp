#include "runtime/two_instants.hpp"

#include <utility>
#include <vector>

#include "calls/lookup_in_progress.hpp"
#include "partition/observing.hpp"
#include "tree/over_fixed.hpp"

namespace tfdude {
namespace {

// Asks for the edges of two paths from one frame, each at its instant. The answers tell which of
// them are dynamic.
class TwoPathsTask final : public Task {
 public:
  TwoPathsTask(const Forest& forest, std::string fixed, std::string a, std::string b,
               const Query& at_a, const Query& at_b)
      : forest_(forest),
        fixed_(std::move(fixed)),
        ends_{std::move(a), std::move(b)},
        at_{at_a, at_b} {}

  [[nodiscard]] std::vector<std::string> frames() const override {
    return {fixed_, ends_[0], ends_[1]};
  }
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point) override {
    parts_.clear();
    for (const std::size_t side : {0U, 1U}) {
      auto planned = route_observe(forest_, directory, fixed_, ends_[side], {}, at_[side].at);
      if (!planned) return tl::unexpected(std::move(planned.error()));
      plans_[side] = *std::move(planned);
      auto& parts = plans_[side].parts;
      for (Part& part : parts) std::get<LookupRequest>(part.request.body).query = at_[side];
      parts_.insert(parts_.end(), parts.begin(), parts.end());
    }
    return {};
  }
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point) override {
    auto answers = values_of(std::move(replies));
    if (!answers) return tl::unexpected(std::move(answers.error()));
    const auto middle = answers->begin() + static_cast<std::ptrdiff_t>(plans_[0].parts.size());
    for (const std::size_t side : {0U, 1U}) {
      auto path = observed_path(plans_[side], side == 0 ? std::vector(answers->begin(), middle)
                                                        : std::vector(middle, answers->end()));
      if (!path) return tl::unexpected(std::move(path.error()));
      paths_[side] = *std::move(path);
    }
    return Next::kDone;
  }

  /// Once it is done: the edges to a, or to b.
  [[nodiscard]] std::vector<EdgeFromFixed> edges(std::size_t side) const {
    std::vector<EdgeFromFixed> edges;
    const ObservedPath& path = paths_[side];
    for (std::size_t i = 0; i < path.edges.size(); ++i) {
      const std::string& id = plans_[side].edges[i].info.id;
      edges.push_back({id, path.edges[i].X_PC, path.edges[i].way == ObservedEdge::Way::kUp,
                       is_moving(id, path.correlations[i]), is_drifting(id, path.correlations[i])});
    }
    return edges;
  }

 private:
  const Forest& forest_;
  const std::string fixed_;
  const std::string ends_[2];
  const Query at_[2];
  ObservePlan plans_[2];
  ObservedPath paths_[2];
  std::vector<Part> parts_;
};

}  // namespace

Result<StampedTransform> TwoInstants::lookup(const std::string& a, const Query& at_a,
                                             const std::string& b, const Query& at_b,
                                             const std::string& fixed, const Deadline& deadline) {
  const auto X_FA = lookups_.lookup<std::string_view>(fixed, a, at_a, deadline);
  if (!X_FA) return tl::unexpected(X_FA.error());
  const auto X_FB = lookups_.lookup<std::string_view>(fixed, b, at_b, deadline);
  if (!X_FB) return tl::unexpected(X_FB.error());
  if (a == fixed || b == fixed) return over_fixed(*X_FA, *X_FB, {}, {}, at_b.order);
  Query then_a = at_a;
  Query then_b = at_b;
  then_a.at = X_FA->stamp;
  then_b.at = X_FB->stamp;
  TwoPathsTask task(structure_.forest, fixed, a, b, then_a, then_b);
  if (auto asked = requests_.run(task, deadline); !asked) return tl::unexpected(asked.error());
  return over_fixed(*X_FA, *X_FB, task.edges(0), task.edges(1), at_b.order);
}

}  // namespace tfdude
