#include <unordered_map>

#include "tfdude/base/id.hpp"

#include "tree/forest_impl.hpp"

// Updates of parts of values.
namespace tfdude {

Result<Transform> with_parts(const Transform& X_PC, std::string_view id,
                             const PartialTransform& parts) {
  const auto pose = Pose::create(parts.rotation.value_or(X_PC.pose.rotation()),
                                 parts.translation.value_or(X_PC.pose.translation()));
  if (!pose) return fail_at("frame " + quote(id), pose.error());
  return Transform{*pose, parts.covariance.value_or(X_PC.covariance)};
}

Result<void> check_parts(const PartialUpdate& edge) {
  return with_parts(Transform(), edge.id, edge.X_PC).map([](const Transform&) {});
}

Result<std::vector<EdgeUpdate>> Forest::Impl::completed(
    const std::vector<PartialUpdate>& edges) const {
  std::vector<EdgeUpdate> all;
  all.reserve(edges.size());
  std::unordered_map<std::uint32_t, Transform> values;  // a frame may be given twice
  for (const PartialUpdate& edge : edges) {
    const auto slot = frames_.held_slot(edge.id);
    if (!slot) return tl::unexpected(slot.error());
    Transform& X_PC = values.try_emplace(*slot, whole(frames_.newest_value(*slot))).first->second;
    auto given = with_parts(X_PC, edge.id, edge.X_PC);
    if (!given) return tl::unexpected(std::move(given.error()));
    X_PC = *given;
    all.push_back({edge.id, X_PC});
  }
  return all;
}

}  // namespace tfdude
