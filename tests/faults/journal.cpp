#include "faults/journal.hpp"

#include <algorithm>
#include <cstdio>

namespace tfdude::faults {
namespace {

constexpr std::size_t kFaultsKept = 40;

// The first violations say most about the cause.
constexpr std::size_t kViolationsTold = 8;

}  // namespace

void Journal::count(const std::string& operation, const std::string& outcome) {
  const std::lock_guard lock(mutex_);
  ++counts_[operation][outcome];
}

void Journal::fault(const std::string& what) {
  const std::lock_guard lock(mutex_);
  faults_.push_back(seconds(now()) + " " + what);
  if (faults_.size() > kFaultsKept) faults_.pop_front();
}

void Journal::violation(const std::string& what, const std::vector<std::string>& history) {
  if (++violations_ > kViolationsTold) return;
  const std::lock_guard lock(mutex_);
  std::printf("VIOLATION at %s s: %s\n", seconds(now()).c_str(), what.c_str());
  for (const std::string& line : history) std::printf("    %s\n", line.c_str());
  std::printf("  the latest faults:\n");
  for (const std::string& line : faults_) std::printf("    %s\n", line.c_str());
  std::fflush(stdout);
}

std::string Journal::counts() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const auto& [operation, outcomes] : counts_) {
    std::size_t sum = 0;
    std::string parts;
    for (const auto& [outcome, count] : outcomes) {
      sum += count;
      parts += ", " + outcome + " " + std::to_string(count);
    }
    text += "  " + operation + " " + std::to_string(sum) + ": " + parts.substr(2) + "\n";
  }
  return text;
}

void Journal::calm_down() {
  calm_since_ = now();
  --disturbances_;
}

double Journal::calm() const { return disturbances_ > 0 ? 0.0 : now() - calm_since_; }

std::string seconds(double time) {
  char text[32];
  std::snprintf(text, sizeof text, "%8.3f", time);
  return text;
}

std::string distribution(std::vector<double> milliseconds) {
  if (milliseconds.empty()) return "none";
  std::sort(milliseconds.begin(), milliseconds.end());
  const auto at = [&](std::size_t percent) {
    return milliseconds[std::min(milliseconds.size() - 1, milliseconds.size() * percent / 100)];
  };
  char text[128];
  std::snprintf(text, sizeof text, "p50 %.1f ms, p90 %.1f ms, p99 %.1f ms, longest %.1f ms of %zu",
                at(50), at(90), at(99), milliseconds.back(), milliseconds.size());
  return text;
}

}  // namespace tfdude::faults
