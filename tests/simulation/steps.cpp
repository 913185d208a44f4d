#include "simulation/steps.hpp"

#include <algorithm>
#include <cstring>

namespace tfdude::simulation {
namespace {

// FNV-1a, a word at a time.
constexpr std::uint64_t kStart = 14695981039346656037ULL;
constexpr std::uint64_t kPrime = 1099511628211ULL;

std::string describe(const std::vector<Steps::Step>& steps, std::size_t number) {
  if (number >= steps.size()) return "had ended";
  const Steps::Step& step = steps[number];
  return std::string(step.touch.kind) + " of process " + std::to_string(step.touch.who) + " at " +
         std::to_string(step.when.count()) + " ns";
}

}  // namespace

void Steps::add(Instant when, const Touch& touch) {
  steps_.push_back({steps_.empty() ? kStart : steps_.back().hash, when, touch});
  mix(static_cast<std::uint64_t>(when.count()));
  mix(touch.who);
  mix(std::string_view(touch.kind));
}

void Steps::mix(std::uint64_t value) {
  std::uint64_t& hash = steps_.back().hash;
  hash = (hash ^ value) * kPrime;
  hash ^= hash >> 32U;
}

void Steps::mix(std::string_view text) {
  while (!text.empty()) {
    const std::string_view word = text.substr(0, sizeof(std::uint64_t));
    std::uint64_t value = 0;
    std::memcpy(&value, word.data(), word.size());
    mix(value);
    text.remove_prefix(word.size());
  }
}

std::optional<std::string> first_difference(const Steps& one, const Steps& other) {
  const auto differs =
      std::mismatch(one.steps_.begin(), one.steps_.end(), other.steps_.begin(), other.steps_.end(),
                    [](const auto& a, const auto& b) { return a.hash == b.hash; });
  const auto number = static_cast<std::size_t>(differs.first - one.steps_.begin());
  if (number == one.steps_.size() && number == other.steps_.size()) return std::nullopt;
  return "step " + std::to_string(number) + ": " + describe(one.steps_, number) +
         "; in the second run: " + describe(other.steps_, number);
}

}  // namespace tfdude::simulation
