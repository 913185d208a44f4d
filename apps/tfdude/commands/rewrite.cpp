#include "tfdude/base/id.hpp"

#include "../commands.hpp"
#include "../lines.hpp"
#include "../samples.hpp"

namespace tfdude::cli {
namespace {

struct Rewrite final : FrameCommand {
  explicit Rewrite(CLI::App& app) : FrameCommand(app) {
    app.add_option("FILE", file, "the samples, in the order of their stamps; -: standard input")
        ->type_name("FILE")
        ->required();
    add_stamp(app, "--from", from, "the interval begins there; default: with the first sample");
    add_stamp(app, "--to", to, "the interval ends there; default: with the last sample");
    app.footer("The lines are those of `publish`, each with this edge and a stamp.\n" +
               app.get_footer());
    explain_angles(app);
  }

  int ask(Client& client, const Common& common) const override {
    const auto begin = optional_stamp(client, from);
    if (!begin) return report(begin.error(), common);
    const auto end = optional_stamp(client, to);
    if (!end) return report(end.error(), common);
    if (*begin && *end && **begin > **end) {
      return report({Errc::kInvalidInput,
                     "--from, " + readable(**begin) + ", is after --to, " + readable(**end)},
                    common);
    }
    const auto samples = read(common, *begin, *end);
    if (!samples) return report(samples.error(), common);
    const TimeInterval interval{begin->value_or(samples->front().stamp),
                                end->value_or(samples->back().stamp)};
    if (auto done = client.rewrite(id, interval, *samples); !done) {
      return report_cause(client, done.error(), common);
    }
    return answer(common,
                  {{"done", "rewritten"},
                   {"id", id},
                   {"samples", samples->size()},
                   {"from_ns", nanoseconds(interval.from)},
                   {"to_ns", nanoseconds(interval.to)}},
                  "rewritten: " + id + ", " + std::to_string(samples->size()) + " samples from " +
                      readable(interval.from) + " to " + readable(interval.to) + "\n");
  }

  /// At least one, in order and within the interval.
  [[nodiscard]] Result<std::vector<EdgeSample>> read(const Common& common,
                                                     const std::optional<Time>& begin,
                                                     const std::optional<Time>& end) const {
    auto lines = Lines::open(file, std::nullopt);
    if (!lines) return tl::unexpected(lines.error());
    SampleReader reader(common.angles);
    std::vector<EdgeSample> samples;
    const auto wrong = [&](const std::string& why) {
      const std::string name = file == "-" ? "standard input" : printable(file);
      return fail(Errc::kInvalidInput,
                  name + ", line " + std::to_string(lines->number()) + ": " + why);
    };
    while (const auto line = lines->next()) {
      const auto sample = reader.read(*line);
      if (!sample) return wrong(sample.error().message);
      if (!*sample) continue;
      const auto& [edges, joints, stamp] = **sample;
      if (edges.size() != 1 || !joints.empty() || edges.front().id != id) {
        return wrong("it is not about edge " + quote(id));
      }
      if (!stamp) return wrong("it has no stamp");
      if (!samples.empty() && *stamp <= samples.back().stamp) {
        return wrong("its stamp, " + readable(*stamp) + ", is not later than " +
                     readable(samples.back().stamp) + " of the sample before");
      }
      if (begin && *stamp < *begin) {
        return wrong("its stamp, " + readable(*stamp) + ", is before --from, " + readable(*begin));
      }
      if (end && *stamp > *end) {
        return wrong("its stamp, " + readable(*stamp) + ", is after --to, " + readable(*end));
      }
      samples.push_back({*stamp, edges.front().X_PC});
    }
    if (!lines->failure().empty()) return wrong(lines->failure());
    if (samples.empty()) return fail(Errc::kInvalidInput, quote(file) + " has no samples");
    return samples;
  }

  std::string file;
  std::string from;
  std::string to;
};

}  // namespace

void add_rewrite(Commands& commands) {
  commands.add<Rewrite>("rewrite", "replace the samples of an edge in an interval of the past",
                        "rewrite odom corrected.csv");
}

}  // namespace tfdude::cli
