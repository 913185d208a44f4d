#pragma once

#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/math/transform_spec.hpp"

namespace tfdude::cli {

/// Exit statuses.
inline constexpr int kDone = 0;
inline constexpr int kRefused = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNoAnswer = 3;

/// What the command line says.
struct Arguments {
  Options options;
  bool json = false;
  std::string id;  ///< also the first frame of a lookup
  std::string other;
  std::string parent;
  std::string partition;
  TransformSpec spec;
  bool covariance = false;
  double rate = 2.0;
};

// Each runs one command, prints its answer and returns the exit status.
int run_tree(Client& client, const Arguments& arguments);
int run_frames(Client& client, const Arguments& arguments);
int run_partitions(Client& client, const Arguments& arguments);
int run_add(Client& client, const Arguments& arguments);
int run_update(Client& client, const Arguments& arguments);
int run_remove(Client& client, const Arguments& arguments);
int run_move(Client& client, const Arguments& arguments);
int run_lookup(Client& client, const Arguments& arguments);
int run_parent(Client& client, const Arguments& arguments);
int run_children(Client& client, const Arguments& arguments);
int run_roots(Client& client, const Arguments& arguments);
int run_exists(Client& client, const Arguments& arguments);
int run_watch(Client& client, const Arguments& arguments);
int run_events(Client& client, const Arguments& arguments);

/// Prints what is wrong with the command line itself, as JSON, and returns the exit status.
int report_usage(const std::string& message);

/// Prints an error and returns the exit status that it means.
int report(const Error& error, const Arguments& arguments);

}  // namespace tfdude::cli
