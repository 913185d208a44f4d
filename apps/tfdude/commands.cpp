#include "commands.hpp"

#include <string>
#include <utility>
#include <vector>

namespace tfdude::cli {

// Each command has a file of its name in commands/.
using AddCommand = void(Commands& commands);
AddCommand add_add, add_children, add_correlate, add_description, add_doctor, add_echo, add_events,
    add_exists, add_export, add_forget, add_frames, add_fuse, add_graph, add_history, add_import,
    add_info, add_joint, add_joints, add_keys, add_lookup, add_monitor, add_move, add_observe,
    add_parent, add_partitions, add_plot, add_point, add_publish, add_record, add_remove,
    add_replay, add_rewrite, add_roots, add_tree, add_update, add_velocity, add_watch, add_web,
    add_why;

Commands::Commands(CLI::App& app) : app_(app) {
  const std::pair<const char*, std::vector<AddCommand*>> groups[] = {
      {"Ask",
       {add_lookup, add_why, add_velocity, add_point, add_tree, add_frames, add_partitions,
        add_roots, add_parent, add_children, add_exists, add_joints, add_description}},
      {"Change",
       {add_add, add_update, add_move, add_remove, add_forget, add_observe, add_fuse, add_correlate,
        add_joint, add_publish, add_rewrite, add_import}},
      {"Watch", {add_watch, add_echo, add_events, add_web}},
      {"Record", {add_record, add_info, add_replay, add_export}},
      {"Draw", {add_plot, add_graph}},
      {"Keys", {add_keys}},
      {"Look for faults", {add_doctor, add_monitor, add_history}},
  };
  for (const auto& [group, commands] : groups) {
    group_ = group;
    for (AddCommand* add_one : commands) add_one(*this);
  }
}

CLI::App& Commands::add_parent_command(const char* name, const char* help, const char* example) {
  return add_app(app_, name, help, example);
}

CLI::App& Commands::add_app(CLI::App& parent, const char* name, const char* help,
                            const char* example) {
  CLI::App* app = parent.add_subcommand(name, help);
  app->group(&parent == &app_ ? group_ : "Subcommands");
  app->footer(std::string("Example: tfdude ") + example);
  return *app;
}

}  // namespace tfdude::cli
