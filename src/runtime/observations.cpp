#include "runtime/observations.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <thread>
#include <unistd.h>
#include <utility>

#include "tfdude/base/id.hpp"

#include "runtime/gathering.hpp"
#include "runtime/wall_clock.hpp"

namespace tfdude {
namespace {

// How often to repeat an observation if edges were written meanwhile, or were observed with still
// others.
constexpr int kObserveAttempts = 8;

// How often, and for how long, to wait for another observation to reach all owners.
constexpr int kTornAttempts = 5;
constexpr Milliseconds kTornPause{1};

bool is_conflict(const Reply& reply) {
  const auto* error = std::get_if<Error>(&reply.body);
  return error != nullptr && error->code == Errc::kChangedMeanwhile;
}

}  // namespace

std::string Observations::new_source() {
  return std::string(kObservedPrefix) + std::to_string(nanoseconds(wall_clock())) + "." +
         std::to_string(getpid()) + "." + std::to_string(++count_);
}

Result<std::vector<SegmentValues>> Observations::values(std::vector<Part>& parts,
                                                        const Deadline& deadline) {
  return values_of(requests_.ask(parts, deadline));
}

// The values of all edges of the plan, at one instant.
Result<ObservedPath> Observations::path(ObservePlan& plan, const Deadline& deadline) {
  auto answers = values(plan.parts, deadline);
  if (!answers) return tl::unexpected(std::move(answers.error()));
  OneInstant found = one_instant(*std::move(answers), std::nullopt);
  if (found.ask_again) {
    for (Part& part : plan.parts) {
      std::get<LookupRequest>(part.request.body).query.at = found.ask_again;
    }
    answers = values(plan.parts, deadline);
    if (!answers) return tl::unexpected(std::move(answers.error()));
    found.answers = *std::move(answers);
  }
  return observed_path(plan, found.answers);
}

// False: nothing was applied; true: everything. One owner is asked before the others, the same for
// all observers of this path. Of two observers that have seen the same values, one is rejected
// there, and can retry before anything was applied.
Result<bool> Observations::revise(std::vector<Part> parts, const Deadline& deadline) {
  if (parts.empty()) return true;
  const auto first = std::min_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    return a.partition < b.partition;
  });
  std::iter_swap(parts.begin(), first);
  std::vector<Part> others(std::make_move_iterator(parts.begin() + 1),
                           std::make_move_iterator(parts.end()));
  parts.resize(1);
  Reply reply = std::move(requests_.ask(parts, deadline).front());
  if (is_conflict(reply)) return false;
  if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
  std::size_t done = 1;
  std::optional<Error> refused;
  for (Reply& other : requests_.ask(others, deadline)) {
    auto* error = std::get_if<Error>(&other.body);
    if (error == nullptr) {
      ++done;
    } else if (!refused) {
      refused = std::move(*error);
    }
  }
  if (!refused) return true;
  refused->message += "; " + std::to_string(done) + " of " + std::to_string(others.size() + 1) +
                      " partitions have applied their part of the observation";
  return tl::unexpected(*std::move(refused));
}

Result<Observed> Observations::observe(const std::string& a, const std::string& b,
                                       const Transform& X_AB, std::optional<Time> stamp,
                                       const ObserveOptions& options, const Deadline& deadline) {
  if (auto ok = check_finite(X_AB); !ok) return fail_at("the measurement", ok.error());
  std::vector<std::string> beside;
  int torn = 0;
  for (int attempt = 0; attempt < kObserveAttempts; ++attempt) {
    ObservePlan used;
    const auto names = [&] {
      std::vector<std::string> all{a, b};
      all.insert(all.end(), beside.begin(), beside.end());
      return all;
    };
    auto path = requests_.retry_on_stale_route(
        deadline, names,
        [&](const Directory& directory) {
          return route_observe(structure_.forest, directory, a, b, beside, stamp);
        },
        [&](ObservePlan& plan) {
          auto found = this->path(plan, deadline);
          used = std::move(plan);
          return found;
        });
    if (!path) return tl::unexpected(std::move(path.error()));
    if (auto ok = requests_.know(path->missing, OnDemand::kAnyAge, deadline); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
    const auto there = [this](const std::string& id) { return structure_.forest.exists(id); };
    if (std::any_of(path->missing.begin(), path->missing.end(), there)) {
      beside.insert(beside.end(), path->missing.begin(), path->missing.end());
      continue;
    }
    // Other owners will soon have what one owner has applied already, unless an edge was written
    // since.
    if (path->torn && torn < kTornAttempts && !deadline.over()) {
      std::this_thread::sleep_for(kTornPause * (1 << torn++));
      --attempt;
      continue;
    }
    const auto found = tfdude::observe(path->edges, X_AB, new_source(), options);
    if (!found) return fail_at("the path from " + quote(a) + " to " + quote(b), found.error());
    auto applied = revise(revisions(used, *path, *found), deadline);
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

Result<std::vector<EdgeConsistency>> Observations::consistency(const std::string& partition) {
  return requests_.ask_all<EdgeConsistency>(partition, ConsistencyRequest{true},
                                            discovery_.call_deadline());
}

}  // namespace tfdude
