#include "tfdude/base/id.hpp"

#include "commands.hpp"
#include "uncertainty_render.hpp"

// Commands that take measurements into account.
namespace tfdude::cli {
namespace {

using Measure = Result<Observed> (*)(Client&, const Arguments&, const Transform&,
                                     std::optional<Time>);

int measure(Client& client, const Arguments& arguments, Measure take) {
  // Zeros would say that it is exact, which nobody means by leaving them out.
  if (!arguments.spec.stddev && !arguments.spec.cov) {
    return report({Errc::kInvalidInput, "a measurement needs --stddev or --cov"}, arguments);
  }
  const auto X = arguments.spec.build();
  if (!X) return report({X.error().code, "the measurement: " + X.error().message}, arguments);
  const auto stamp = optional_stamp(arguments.stamp, wall_clock());
  if (!stamp) return report(stamp.error(), arguments);
  const auto observed = take(client, arguments, *X, *stamp);
  if (!observed) return refuse(client, observed.error(), arguments);
  (void)answer(arguments, observed_json(*observed), describe(*observed));
  return observed->accepted ? kDone : kRefused;
}

}  // namespace

int run_observe(Client& client, const Arguments& arguments) {
  return measure(
      client, arguments,
      [](Client& to, const Arguments& said, const Transform& X, std::optional<Time> stamp) {
        return to.observe(said.id, said.other, X, stamp, said.observe);
      });
}

int run_fuse(Client& client, const Arguments& arguments) {
  return measure(
      client, arguments,
      [](Client& to, const Arguments& said, const Transform& X, std::optional<Time> stamp) {
        return to.fuse(said.id, X, stamp, said.observe);
      });
}

}  // namespace tfdude::cli
