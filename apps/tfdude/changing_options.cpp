#include "changing_options.hpp"

#include <cstdlib>

#include "tfdude/base/id.hpp"

#include "../numbers.hpp"

namespace tfdude::cli {
namespace {

void add_measuring_commands(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* observe =
      add_command(app, "observe", "correct the edges of a path by a measurement of B in A",
                  "observe world tool --xyz 0.8 0.1 1.1 --stddev 1e-3 1e-3 1e-3 "
                  "2e-3 2e-3 2e-3",
                  run_observe, chosen);
  add_ends(observe, arguments);
  auto* fuse = add_command(app, "fuse", "fuse a measurement of an edge with its value",
                           "fuse camera --xyz 0.1 0 0.3 --stddev 1e-3 1e-3 1e-3 2e-3 2e-3 2e-3",
                           run_fuse, chosen);
  add_id(fuse, arguments);
  for (CLI::App* command : {observe, fuse}) {
    add_pose_options(*command, arguments);
    add_stamp(command, "--stamp", arguments.stamp,
              "when it was measured: seconds since the epoch or, negative, before now");
    command
        ->add_option("--gate", arguments.observe.gate,
                     "chi-squared gate probability; 1: accept all")
        ->check([](const std::string& text) {
          const double gate = std::strtod(text.c_str(), nullptr);
          return gate > 0 && gate <= 1 ? "" : text + " is not above 0 and at most 1";
        });
    command->add_flag_callback(
        "--correlated", [&arguments] { arguments.observe.independent = false; },
        "possibly correlated with the edges: use covariance intersection");
  }
}

void add_correlate_command(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* correlate =
      add_command(app, "correlate", "declare how an edge's error is correlated with others",
                  "correlate elbow --source supply 0 0 0 0 0 0.002", run_correlate, chosen);
  add_id(correlate, arguments);
  correlate->add_flag(
      "--unknown", arguments.unknown,
      "the edge's own error may be correlated with any other; default: independent");
  correlate
      ->add_option(
          "--source", arguments.sources,
          "error shared with all edges that name the same source: this edge's error for one "
          "standard deviation of the source [m m m rad rad rad]; repeat for each dimension")
      ->type_name("NAME 6 NUMBERS")
      ->type_size(kSourceSize)
      ->allow_extra_args(false);
  explain_angles(*correlate);
  correlate->parse_complete_callback([&arguments] {
    for (std::size_t i = 0; i < arguments.sources.size(); ++i) {
      const std::string& said = arguments.sources[i];
      if (i % kSourceSize == 0 || is_number(said)) continue;
      throw CLI::ValidationError("--source", quote(said) + " is not a number");
    }
  });
}

void add_frame_commands(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* add = add_command(app, "add", "add a frame", "add tool --parent camera --xyz 0.1 0 -0.2",
                          run_add, chosen);
  add_id(add, arguments);
  add->add_option("--parent", arguments.parent, "its parent")->required();
  add->add_option("--partition", arguments.partition, "its owner, if not its parent's");
  add_pose_options(*add, arguments);
  auto* update = add_command(app, "update", "set parts of an edge; other parts stay unchanged",
                             "update tool --rpy 0 0 1.57", run_update, chosen);
  add_id(update, arguments);
  add_pose_options(*update, arguments);
  add_sample_stamp(update, arguments);
  add_id(add_command(app, "remove", "remove a frame and all below it", "remove tool", run_remove,
                     chosen),
         arguments);
  add_command(app, "forget", "delete all data of a partition that will not return", "forget arm",
              run_forget, chosen)
      ->add_option("PARTITION", arguments.id, "the partition; rejected while it is reachable")
      ->required();
  auto* move = add_command(app, "move", "move a frame to a new parent", "move tool --parent arm_2",
                           run_move, chosen);
  add_id(move, arguments);
  move->add_option("--parent", arguments.parent, "the new parent")->required();
  add_pose_options(*move, arguments);
}

}  // namespace

void add_changing_commands(CLI::App& app, Arguments& arguments, Command& chosen) {
  add_frame_commands(app, arguments, chosen);
  add_measuring_commands(app, arguments, chosen);
  add_correlate_command(app, arguments, chosen);
}

}  // namespace tfdude::cli
