#include "measurement.hpp"

#include <cmath>
#include <cstdlib>

#include "../numbers.hpp"
#include "../rendering/format.hpp"
#include "../rendering/json.hpp"
#include "../rendering/text.hpp"
#include "answer.hpp"
#include "options.hpp"
#include "stamps.hpp"

namespace tfdude::cli {
namespace {

std::string describe(const Observed& observed) {
  std::string text = observed.accepted ? "accepted" : "rejected by the gate";
  text += format("     squared distance %.3f in %d dimensions", observed.distance_squared,
                 observed.dimensions);
  if (std::isfinite(observed.limit)) text += format(", limit %.3f", observed.limit);
  text += "\n";
  if (!observed.corrected.empty()) text += "corrected    " + joined(observed.corrected) + "\n";
  if (!observed.forgotten.empty()) text += "forgotten    " + joined(observed.forgotten) + "\n";
  if (observed.accepted && observed.corrected.empty()) text += "corrected    nothing\n";
  return text;
}

nlohmann::json json_of(const Observed& observed) {
  const auto finite = [](double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
  };
  nlohmann::json json{
      {"accepted", observed.accepted},     {"distance_squared", finite(observed.distance_squared)},
      {"dimensions", observed.dimensions}, {"limit", finite(observed.limit)},
      {"corrected", observed.corrected},   {"forgotten", observed.forgotten}};
  add_stamp(json, observed.stamp);
  return json;
}

}  // namespace

void Measurement::add_options(CLI::App& app) {
  add_pose(app, spec);
  cli::add_stamp(app, "--stamp", stamp,
                 "when it was measured: seconds since the epoch or, negative, before now");
  app.add_option("--gate", how.gate, "chi-squared gate probability; 1: accept all")
      ->check([](const std::string& text) {
        const auto gate = to_number(text);
        return gate && *gate > 0 && *gate <= 1 ? "" : text + " is not above 0 and at most 1";
      });
  app.add_flag_callback(
      "--correlated", [this] { how.independent = false; },
      "possibly correlated with the edges: use covariance intersection");
}

int Measurement::send(Client& client, const Common& common, const Send& send) const {
  // A default of zero would mean an exact measurement, which is hardly intended.
  if (!spec.stddev && !spec.cov) {
    return report({Errc::kInvalidInput, "a measurement needs --stddev or --cov"}, common);
  }
  const auto X = in_radians(spec, common.angles).build();
  if (!X) return report({X.error().code, "the measurement: " + X.error().message}, common);
  const auto at = optional_stamp(client, stamp);
  if (!at) return report(at.error(), common);
  const auto observed = send(*X, *at);
  if (!observed) return report_cause(client, observed.error(), common);
  (void)answer(common, json_of(*observed), describe(*observed));
  return observed->accepted ? kDone : kRejected;
}

}  // namespace tfdude::cli
