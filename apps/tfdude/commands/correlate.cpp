#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "tfdude/base/id.hpp"

#include "../../numbers.hpp"
#include "../commands.hpp"

namespace tfdude::cli {
namespace {

// Values of --source: the source's name, and one column of the loading.
constexpr int kSourceSize = 7;

struct Correlate final : FrameCommand {
  explicit Correlate(CLI::App& app) : FrameCommand(app) {
    app.add_flag("--unknown", unknown,
                 "the edge's own error may be correlated with any other; default: independent");
    app.add_option(
           "--source", sources,
           "error shared with all edges that name the same source: this edge's error for one "
           "standard deviation of the source [m m m rad rad rad]; repeat for each dimension")
        ->type_name("NAME 6 NUMBERS")
        ->type_size(kSourceSize)
        ->allow_extra_args(false);
    explain_angles(app);
    app.parse_complete_callback([this] {
      for (std::size_t i = 0; i < sources.size(); ++i) {
        if (i % kSourceSize == 0 || is_number(sources[i])) continue;
        throw CLI::ValidationError("--source", quote(sources[i]) + " is not a number");
      }
    });
  }

  int ask(Client& client, const Common& common) const override {
    const Correlation correlation{unknown, common_errors(common.angles), {}};
    return answer_done(client, common, client.correlate(id, correlation), "correlated", id);
  }

  // The columns of one source form one loading, in the order in which they are given.
  [[nodiscard]] std::vector<CommonError> common_errors(const AngleUnit& angles) const {
    constexpr std::size_t kRows = kSourceSize - 1;
    std::vector<CommonError> errors;
    for (std::size_t at = 0; at + kRows < sources.size(); at += kSourceSize) {
      const std::string& source = sources[at];
      Twist column;
      for (std::size_t row = 0; row < kRows; ++row) {
        column[static_cast<Eigen::Index>(row)] =
            to_number(sources[at + 1 + row]).value_or(0);  // they were checked
      }
      column.tail<3>() /= angles.per_radian;
      auto error = std::find_if(errors.begin(), errors.end(),
                                [&](const CommonError& one) { return one.source == source; });
      if (error == errors.end()) {
        errors.push_back({source, false, Loading(kRows, 0)});
        error = std::prev(errors.end());
      }
      error->loading.conservativeResize(Eigen::NoChange, error->loading.cols() + 1);
      error->loading.rightCols<1>() = column;
    }
    return errors;
  }

  bool unknown = false;
  std::vector<std::string> sources;  // for each column: its source's name and 6 numbers
};

}  // namespace

void add_correlate(Commands& commands) {
  commands.add<Correlate>("correlate", "declare how an edge's error is correlated with others",
                          "correlate elbow --source supply 0 0 0 0 0 0.002");
}

}  // namespace tfdude::cli
