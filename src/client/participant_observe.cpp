#include <algorithm>
#include <unistd.h>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/partition/observing.hpp"

#include "client/participant.hpp"

// Measurements of paths, and what they have said of covariances.
namespace tfdude {
namespace {

// How often edges that were written meanwhile, or were observed with still others, are asked for again.
constexpr int kObserveAttempts = 8;

bool is_conflict(const Reply& reply) {
  const auto* error = std::get_if<Error>(&reply.body);
  return error != nullptr && error->code == Errc::kChangedMeanwhile;
}

}  // namespace

std::string Participant::new_source() {
  return std::string(kObservedPrefix) + std::to_string(nanoseconds(wall_clock())) + "." +
         std::to_string(getpid()) + "." + std::to_string(++observations_);
}

// The values of all edges that the plan names, of one instant.
Result<ObservedPath> Participant::ask_observed(ObservePlan& plan) {
  auto answers = ask_values(plan.parts);
  if (!answers) return tl::unexpected(std::move(answers.error()));
  OneInstant found = one_instant(*std::move(answers), std::nullopt);
  if (found.ask_again) {
    for (Part& part : plan.parts) {
      std::get<LookupRequest>(part.request.body).query.at = found.ask_again;
    }
    answers = ask_values(plan.parts);
    if (!answers) return tl::unexpected(std::move(answers.error()));
    found.answers = *std::move(answers);
  }
  return observed_path(plan, found.answers);
}

// Nothing was applied (false), or all (true).
Result<bool> Participant::revise(std::vector<Part> parts) {
  const std::vector<Reply> replies = ask(parts, Clock::now() + options_.timeout);
  const Error* first = nullptr;
  std::size_t done = 0;
  bool conflicts = true;
  for (const Reply& reply : replies) {
    if (std::holds_alternative<Done>(reply.body)) {
      ++done;
      continue;
    }
    conflicts = conflicts && is_conflict(reply);
    if (first == nullptr) first = std::get_if<Error>(&reply.body);
  }
  if (first == nullptr) return true;
  if (done == 0 && conflicts) return false;
  Error error = *first;
  if (done > 0) {
    error.message += "; " + std::to_string(done) + " of " + std::to_string(parts.size()) +
                     " partitions have applied their part of the observation";
  }
  return tl::unexpected(std::move(error));
}

Result<Observed> Participant::observe(const std::string& a, const std::string& b,
                                      const Transform& X_AB, std::optional<Time> stamp,
                                      const ObserveOptions& options) {
  if (auto ok = check_finite(X_AB); !ok) return fail_at("the measurement", ok.error());
  std::vector<std::string> beside;
  for (int attempt = 0; attempt < kObserveAttempts; ++attempt) {
    ObservePlan used;
    auto path = healed([&] { return route_observe(forest_, directory_, a, b, beside, stamp); },
                       [&](ObservePlan& plan) {
                         auto found = ask_observed(plan);
                         used = std::move(plan);
                         return found;
                       });
    if (!path) return tl::unexpected(std::move(path.error()));
    const auto there = [this](const std::string& id) { return forest_.exists(id); };
    if (std::any_of(path->missing.begin(), path->missing.end(), there)) {
      beside.insert(beside.end(), path->missing.begin(), path->missing.end());
      continue;
    }
    const auto found = tfdude::observe(path->edges, X_AB, new_source(), options);
    if (!found) return fail_at("the path from " + quote(a) + " to " + quote(b), found.error());
    auto applied = revise(revisions(used, *path, *found));
    if (!applied) return tl::unexpected(std::move(applied.error()));
    if (!*applied) continue;
    Observed observed{
        found->distance_squared, found->dimensions, found->limit, found->accepted, {}, path->stamp};
    for (std::size_t k = 0; k < used.edges.size(); ++k) {
      if (found->edges[k].corrected) observed.corrected.push_back(used.edges[k].info.id);
    }
    return observed;
  }
  return fail(Errc::kChangedMeanwhile, "edges between " + quote(a) + " and " + quote(b) +
                                           " were written each time that they were observed");
}

Result<std::vector<EdgeConsistency>> Participant::consistency(const std::string& partition) {
  return healed(
      [&]() -> Result<Part> {
        const auto owner = directory_.owner(partition);
        if (!owner) return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
        return route_to(directory_, *owner, Request{0, partition, ConsistencyRequest{true}});
      },
      [&](Part& part) -> Result<std::vector<EdgeConsistency>> {
        std::vector<Part> parts{std::move(part)};
        Reply reply = std::move(ask(parts, Clock::now() + options_.timeout).front());
        if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
        auto* all = std::get_if<std::vector<EdgeConsistency>>(&reply.body);
        return all != nullptr ? std::move(*all) : std::vector<EdgeConsistency>();
      });
}

}  // namespace tfdude
