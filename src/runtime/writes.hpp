#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/context.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// A participant's changes of frames, its own and those of others: structure, values, stored data.
/// Client describes the return values.
/// @par Thread safety  All functions are thread-safe.
class Writes {
 public:
  explicit Writes(const Context& context)
      : structure_(context.structure),
        discovery_(context.discovery),
        requests_(context.requests),
        member_(context.member) {}

  [[nodiscard]] Result<void> add(const std::string& id, const AddRequest& request,
                                 const std::string& partition);
  [[nodiscard]] Result<void> remove(const std::string& id);
  [[nodiscard]] Result<void> move(const std::string& id, const MoveRequest& request);
  [[nodiscard]] Result<void> hand_over(const std::string& id, const std::string& partition,
                                       const std::optional<std::string>& parent,
                                       const PartialTransform& X_PC);
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges,
                                    std::optional<Time> stamp);
  [[nodiscard]] Result<void> update_partial(const std::vector<PartialUpdate>& edges,
                                            std::optional<Time> stamp);
  [[nodiscard]] Result<void> publish(const std::vector<EdgeUpdate>& edges,
                                     std::optional<Time> stamp);
  [[nodiscard]] Result<void> rewrite(const std::string& id, const TimeInterval& interval,
                                     const std::vector<EdgeSample>& samples);
  [[nodiscard]] Result<void> correlate(const std::string& id, const Correlation& correlation);
  [[nodiscard]] Result<void> forget(const std::string& partition);

  /// Whether a local update failed because it concerns frames held elsewhere.
  static bool is_elsewhere(const Error& error) {
    return error.code == Errc::kUnknownFrame || error.code == Errc::kNotOwner;
  }

 private:
  [[nodiscard]] Result<void> move(const std::string& id, const MoveRequest& request,
                                  const Deadline& deadline);
  template <class Edge>
  [[nodiscard]] Result<void> ask_to_update(const std::vector<Edge>& edges,
                                           std::optional<Time> stamp);
  [[nodiscard]] Result<std::vector<Part>> route_forget(const Directory& directory,
                                                       const std::string& partition);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  MemberRunner& member_;
  std::atomic<std::uint64_t> rewrites_{0};  // begun
};

}  // namespace tfdude
