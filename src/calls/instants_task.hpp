#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calls/lookup_in_progress.hpp"

namespace tfdude {

/// One lookup at some instants, each asked for by itself, but two of them by one request.
class InstantsTask final : public Task {
 public:
  using Found = Result<StampedTransform>;

  /// The most instants of one task.
  static constexpr std::size_t kMost = 64;

  InstantsTask(const Forest& forest, ClockKind own, WantedLookup wanted,
               std::vector<Time> instants);

  [[nodiscard]] std::vector<std::string> frames() const override { return {wanted_.a, wanted_.b}; }
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;

  /// What the owners were asked for, at some instant.
  [[nodiscard]] const std::vector<Part>& planned() const { return plan_.parts; }
  /// Once it is done: by instant.
  [[nodiscard]] std::vector<Found>& found() { return found_; }

 private:
  // Instants that are asked for together.
  struct Asked {
    std::size_t first;
    std::optional<std::size_t> second;
  };

  void ask();
  void take(const Asked& asked, std::vector<Reply> replies);
  void conclude(std::size_t i, Found found);

  const Forest& forest_;
  const ClockKind own_;
  const WantedLookup wanted_;
  const std::vector<Time> instants_;
  LookupPlan plan_;
  std::string differs_;
  std::vector<Asked> asked_;
  std::vector<Part> parts_;
  std::vector<Found> found_;
};

}  // namespace tfdude
