#pragma once

#include <csignal>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"
#include "tfdude/keys/key_store.hpp"
#include "tfdude/math/transform_spec.hpp"

#include "render.hpp"
#include "source.hpp"

namespace tfdude::cli {

/// Exit statuses.
inline constexpr int kDone = 0;
inline constexpr int kRefused = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNoAnswer = 3;

/// Instead of an exit status, before anything was printed: all owners are of an earlier version,
/// and do not know the request for single frames (Options::follow). So the command must be repeated
/// by a client that receives all frames.
inline constexpr int kNeedsAllFrames = -1;

/// Number of values of `correlate --source`: the source's name, and one column of the loading.
inline constexpr int kSourceSize = 7;

/// What is given to the commands of `keys`.
struct KeysArguments {
  std::string directory;  ///< a key store, or the directory of an identity
  std::string name;       ///< of an identity
  std::string partition;  ///< of a daemon
  Roles roles;
  bool sign = false;
  std::vector<std::uint32_t> domains{0, 232};  ///< first and last
  Days lifetime{0};                            ///< zero: the default
};

/// What is given to the commands that record, replay, or ask a recording.
struct RecordingArguments {
  std::string file;
  double split_mb = 0;  ///< 0: as RecordingOptions
  double split_s = 0;   ///< 0: never
  bool raw = false;     ///< not compressed
  double rate = 1;      ///< of a replay: how many times as fast
  bool loop = false;
  bool paused = false;
};

/// The command line.
struct Arguments {
  Options options;
  bool json = false;
  std::string id;  ///< also the first frame of a lookup
  std::string other;
  std::string parent;
  std::string partition;
  TransformSpec spec;
  AngleUnit angles = kRadian;  ///< of angles that are typed, and of printed text
  bool covariance = false;     ///< print the full one
  bool matrix = false;         ///< print poses as matrices
  double rate = 2.0;
  std::string stamp;  ///< as written, see parse_stamp(); also the instant of a lookup
  std::string other_stamp;
  std::string fixed;
  double extrapolate_ms = 0;
  bool age_noise = false;
  double wait_ms = 0;
  bool composed = false;
  bool once = false;
  bool watch = false;    ///< tree, lookup: redraw it until interrupted
  bool unknown = false;  ///< correlation
  int order = 2;
  ObserveOptions observe;
  std::vector<std::string> sources;  ///< for each column: its source's name and 6 numbers
  std::string out;                   ///< the picture's file
  int samples = 0;
  std::vector<std::string> joints;     ///< a name and a position, or NAME=POSITION each
  std::optional<double> joint_stddev;  ///< of these positions
  std::string from;                    ///< the file of samples; "-": standard input
  std::optional<double> pace;          ///< samples per second from the file
  std::vector<double> points;          ///< three coordinates each
  std::vector<double> point_stddev;
  std::vector<double> point_cov;  ///< upper triangle
  bool direction = false;
  bool joint_covariance = false;     ///< of all points together
  double over = 0.1;                 ///< interval of a velocity [s]
  std::optional<std::size_t> depth;  ///< of a graph
  RecordingArguments recording;
  KeysArguments keys;
};

[[nodiscard]] Time wall_clock();

/// The time with which to compare the stamps of a path, for ages; nothing if an owner on it uses
/// another clock, or if the time is not known.
[[nodiscard]] std::optional<Time> present(Source source, const Arguments& arguments,
                                          const std::string& a, const std::string& b);
/// Likewise, for one partition.
[[nodiscard]] std::optional<Time> present(Source source, const Arguments& arguments,
                                          const PartitionInfo& partition);

/// The line with the stamp of a transform on the path between `id` and `other`.
[[nodiscard]] std::string stamp_line(Source source, const Arguments& arguments, Time stamp);

/// Reads a stamp of the command line: decimal seconds since the epoch, exact to nanoseconds. A
/// negative number counts back from now. @return kInvalidInput naming the text.
[[nodiscard]] Result<Time> parse_stamp(const std::string& text, Time now);

/// As parse_stamp(), with the clock of the source, which only a relative stamp needs; no stamp for
/// an empty text. @return also kNotYet
[[nodiscard]] Result<std::optional<Time>> optional_stamp(Source source, const std::string& text);

/// The signals that end a command that runs until interrupted; main() has blocked them.
[[nodiscard]] sigset_t signals_to_stop();
/// Waits between two outputs of a command that runs until interrupted.
/// @return whether it was interrupted
[[nodiscard]] bool interrupted_within(double seconds);

/// Prints an answer as JSON or as text. @return the exit status
int answer(const Arguments& arguments, const nlohmann::json& json, const std::string& text);
/// Prints that the command changed its frame or joint, or why it did not. @return the exit status
int finish(Client& client, const Result<void>& changed, const Arguments& arguments,
           const std::string& what);
/// "the built-in profile", or which one.
[[nodiscard]] std::string profile_of(const Options& options);
/// That no partition answers, and what may be the cause.
[[nodiscard]] std::string nobody_answers(const Arguments& arguments);
/// Why a request failed: with an unknown frame, it may be that no partition answers.
[[nodiscard]] Error cause_of(Source source, const Error& error, const Arguments& arguments);
/// Prints why the request failed. @return the exit status, or kNeedsAllFrames
int refuse(Source source, const Error& error, const Arguments& arguments);

/// Prints a change.
void print_event(const Change& change, const Arguments& arguments);
[[nodiscard]] Order order_of(const Arguments& arguments);
/// How the options want transforms to be printed.
[[nodiscard]] Shown shown_by(const Arguments& arguments);
/// A transform of a path, as `lookup` and `echo` print it.
[[nodiscard]] nlohmann::json path_json(Source source, const Arguments& arguments,
                                       const StampedTransform& X_AB);

// Each function runs one command, prints its answer and returns the exit status, or
// kNeedsAllFrames.
int run_tree(Source source, const Arguments& arguments);
int run_frames(Source source, const Arguments& arguments);
int run_partitions(Client& client, const Arguments& arguments);
int run_add(Client& client, const Arguments& arguments);
int run_update(Client& client, const Arguments& arguments);
int run_remove(Client& client, const Arguments& arguments);
int run_forget(Client& client, const Arguments& arguments);
int run_move(Client& client, const Arguments& arguments);
int run_lookup(Source source, const Arguments& arguments);
/// Redraws what `lookup` prints, until interrupted.
int follow_lookup(Client& client, const Arguments& arguments);
int run_velocity(Client& client, const Arguments& arguments);
int run_parent(Client& client, const Arguments& arguments);
int run_children(Client& client, const Arguments& arguments);
int run_roots(Client& client, const Arguments& arguments);
int run_exists(Client& client, const Arguments& arguments);
int run_watch(Client& client, const Arguments& arguments);
int run_events(Client& client, const Arguments& arguments);
int run_history(Client& client, const Arguments& arguments);
int run_echo(Client& client, const Arguments& arguments);
int run_observe(Client& client, const Arguments& arguments);
int run_fuse(Client& client, const Arguments& arguments);
int run_correlate(Client& client, const Arguments& arguments);
int run_joint(Client& client, const Arguments& arguments);
int run_point(Source source, const Arguments& arguments);
int run_publish(Client& client, const Arguments& arguments);
/// Sends the lines of a file.
/// @param acknowledged  joints only, each line one commit of each owner
int send_lines(Client& client, const Arguments& arguments, bool acknowledged);
int run_joints(Source source, const Arguments& arguments);
int run_description(Client& client, const Arguments& arguments);
int run_monitor(Client& client, const Arguments& arguments);
int run_plot(Source source, const Arguments& arguments);
int run_graph(Source source, const Arguments& arguments);
int run_doctor(const Arguments& arguments);

/// Prints an error of the command line as JSON. @return the exit status
int report_usage(const std::string& message);

/// Prints an error. @return the exit status for it
int report(const Error& error, const Arguments& arguments);

}  // namespace tfdude::cli
