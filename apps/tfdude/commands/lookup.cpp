#include "../../rendering/screen.hpp"
#include "../../rendering/text.hpp"
#include "../commands.hpp"
#include "../path.hpp"

namespace tfdude::cli {
namespace {

void add_milliseconds(CLI::App& app, const char* name, double& value, const char* help) {
  app.add_option(name, value, help)->type_name("MS")->check(within(0, 3.6e6, "0 to 3600000"));
}

struct Lookup final : Question {
  explicit Lookup(CLI::App& app) {
    single_frames = true;
    path.add_ends(app);
    path.add_printing(app);
    auto* redraw = add_watch(app, *this, watch);
    add_instant(app, at);
    auto* option = app.add_option(
        "--fixed", fixed, "frame that does not move between --at (for A) and --at-b (for B)");
    option->check(id_problem);
    add_stamp(app, "--at-b", at_b, "the instant for B; --at is for A")->needs(option);
    add_milliseconds(app, "--extrapolate", extrapolate_ms,
                     "how far to extrapolate beyond an edge's newest sample");
    app.add_flag("--age-noise", age_noise, "add the edges' process noise from --at until now");
    add_order(app, order);
    add_milliseconds(app, "--wait", wait_ms, "how long to wait for frames and data");
    app.get_option("--wait")->excludes(option)->check([](const std::string& text) {
      return is_whole_number(text) ? "" : "'" + text + "' is no whole number of milliseconds";
    });
    add_recording(app);
    add_stamp(app, "--believed-at", believed_at,
              "what was known at this instant of that of --at, before later data corrected it; of "
              "the live system, if its owners remember that")
        ->excludes(option);
    for (const char* other : {"--at", "--extrapolate", "--age-noise", "--order", "--wait",
                              "--fixed", "--recording", "--believed-at"}) {
      redraw->excludes(app.get_option(other));
    }
  }

  int ask(Client& client, const Common& common) const override {
    if (!watch) return ask_source(client, common);
    Screen screen;
    WatchOptions options;
    options.rate = kRedrawRate;
    return follow(client, common, path, options, [&](const StampedTransform& X_AB) {
      if (common.json) {
        (void)path.print(client, common, X_AB);
      } else {
        screen.redraw(path.b + " in " + path.a + "\n" + path.text(client, common, X_AB) +
                      describe(X_AB.basis));
      }
    });
  }

  int ask_source(Source source, const Common& common) const override {
    const auto X_AB = look_up(source);
    if (!X_AB) return report_cause(source, X_AB.error(), common);
    return path.print(source, common, *X_AB, describe(X_AB->basis));
  }

  [[nodiscard]] Result<StampedTransform> look_up(Source source) const {
    const auto query = query_at(source, at);
    if (!query) return tl::unexpected(query.error());
    if (!fixed.empty()) {
      const auto other = query_at(source, at_b);
      if (!other) return tl::unexpected(other.error());
      return source.lookup(path.a, *query, path.b, *other, fixed);
    }
    const Milliseconds wait(static_cast<long>(wait_ms));
    if (wait.count() == 0) return source.lookup(path.a, path.b, *query);
    return source.lookup(path.a, path.b, *query, wait);
  }

  [[nodiscard]] Result<Query> query_at(Source source, const std::string& stamp) const {
    Query query;
    const auto instant = optional_stamp(source, stamp);
    if (!instant) return tl::unexpected(instant.error());
    const auto believed = optional_stamp(source, believed_at);
    if (!believed) return tl::unexpected(believed.error());
    query.at = *instant;
    query.believed_at = *believed;
    query.extrapolate = std::chrono::nanoseconds(static_cast<std::int64_t>(extrapolate_ms * 1e6));
    if (age_noise) {
      const auto now = source.present();
      if (!now) return tl::unexpected(now.error());
      query.age_noise_until = *now;
    }
    query.order = static_cast<Order>(order);
    return query;
  }

  Path path;
  std::string believed_at;  // as typed, see parse_stamp()
  bool watch = false;
  std::string fixed;
  std::string at_b;
  double extrapolate_ms = 0;
  bool age_noise = false;
  int order = 2;
  double wait_ms = 0;
};

}  // namespace

void add_lookup(Commands& commands) {
  commands.add<Lookup>("lookup", "pose of B in A, with its uncertainty",
                       "lookup world hand_left --cov");
}

}  // namespace tfdude::cli
