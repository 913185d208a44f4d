#include "commands.hpp"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <string_view>
#include <unistd.h>
#include <utility>

#include "tfdude/base/id.hpp"

#include "render.hpp"
#include "screen.hpp"
#include "terminal.hpp"

namespace tfdude::cli {
namespace {

void print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

void print_error(std::string_view code, std::string_view message) {
  print(dump({{"error", {{"code", code}, {"message", message}}}}) + "\n");
}

// Prints a list of ids, one per line.
int list(const Arguments& arguments, const char* key, const std::vector<std::string>& ids) {
  std::string text;
  for (const std::string& id : ids) text += id + "\n";
  return answer(arguments, {{key, ids}}, text);
}

// Whether there is any partition.
Result<void> somebody_there(Source source, const Arguments& arguments) {
  const auto partitions = source.partitions();
  if (!partitions) return tl::unexpected(partitions.error());
  if (!partitions->empty()) return {};
  if (!source.live()) return fail(Errc::kUnknownPartition, "the recording has no partition then");
  return fail(Errc::kUnreachable, nobody_answers(arguments));
}

// An empty answer without any partition counts as no answer. @return the exit status
int none_there(Source source, const Arguments& arguments, bool found) {
  if (found) return kDone;
  const auto somebody = somebody_there(source, arguments);
  return somebody ? kDone : report(somebody.error(), arguments);
}

int refuse_pose(const Error& error, const Arguments& arguments) {
  return report({error.code, "frame " + quote(arguments.id) + ": " + error.message}, arguments);
}

}  // namespace

std::string profile_of(const Options& options) {
  if (options.profile.empty()) return "the built-in profile";
  return "profile " + quote(options.profile);
}

std::string nobody_answers(const Arguments& arguments) {
  return "no partition answers in domain " + std::to_string(arguments.options.domain) + " with " +
         profile_of(arguments.options) +
         ": all participants must use the same domain, profile and discovery server";
}

Time wall_clock() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

int answer(const Arguments& arguments, const nlohmann::json& json, const std::string& text) {
  print(arguments.json ? dump(json) + "\n" : text);
  return kDone;
}

int finish(Client& client, const Result<void>& changed, const Arguments& arguments,
           const std::string& what) {
  if (!changed) return refuse(client, changed.error(), arguments);
  return answer(arguments, {{"done", what}, {"id", arguments.id}},
                what + " " + arguments.id + "\n");
}

Error cause_of(Source source, const Error& error, const Arguments& arguments) {
  if (!is_unknown(error.code)) return error;
  const auto somebody = somebody_there(source, arguments);
  return somebody ? error : somebody.error();
}

int refuse(Source source, const Error& failed, const Arguments& arguments) {
  const Error error = cause_of(source, failed, arguments);
  if (error.code == Errc::kUnsupported && arguments.options.follow) return kNeedsAllFrames;
  return report(error, arguments);
}

sigset_t signals_to_stop() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

bool interrupted_within(double seconds) {
  const sigset_t stop_signals = signals_to_stop();
  const auto whole = static_cast<std::time_t>(seconds);
  const timespec pause{whole, static_cast<long>((seconds - static_cast<double>(whole)) * 1e9)};
  return sigtimedwait(&stop_signals, nullptr, &pause) >= 0;
}

int report_usage(const std::string& message) {
  print_error("usage", message);
  return kWrongUsage;
}

int report(const Error& error, const Arguments& arguments) {
  if (arguments.json) {
    print_error(to_string(error.code), error.message);
  } else {
    const std::string who = painted(Look::kBad, "tfdude:", terminal_of(STDERR_FILENO));
    std::fprintf(stderr, "%s %s\n", who.c_str(), error.message.c_str());
  }
  switch (error.code) {
    case Errc::kTimeout:
    case Errc::kUnreachable:
    case Errc::kIncompatible:
      return kNoAnswer;
    case Errc::kConfig:
      return kWrongUsage;
    default:
      return kRefused;
  }
}

namespace {

/// All frames, and the partitions that are not reachable.
struct Structure {
  std::vector<Frame> frames;
  std::vector<PartitionInfo> absent;

  [[nodiscard]] std::vector<std::string> absent_names() const {
    std::vector<std::string> names;
    for (const PartitionInfo& partition : absent) names.push_back(partition.name);
    return names;
  }
  [[nodiscard]] nlohmann::json json() const {
    const auto names = absent_names();
    nlohmann::json all = nlohmann::json::array();
    for (const Frame& frame : frames) {
      all.push_back(frame_json(frame));
      all.back()["reachable"] = std::count(names.begin(), names.end(), frame.partition) == 0;
    }
    return all;
  }
  /// A line for each partition that is not reachable.
  [[nodiscard]] std::string warnings() const {
    std::string text;
    for (const PartitionInfo& one : absent) {
      const auto count = std::count_if(frames.begin(), frames.end(), [&](const Frame& frame) {
        return frame.partition == one.name;
      });
      text += "partition " + quote(one.name) + " " + why_absent(one) + " since " +
              to_string(one.since) + ": " +
              (count == 0 ? "its frames are not known here"
                          : "its " + std::to_string(count) +
                                " frames are listed as they were last known") +
              "\n";
    }
    return text;
  }
};

Result<Structure> structure_of(Source source) {
  auto frames = source.frames();
  if (!frames) return tl::unexpected(std::move(frames.error()));
  auto partitions = source.partitions();
  if (!partitions) return tl::unexpected(std::move(partitions.error()));
  Structure all{*std::move(frames), {}};
  for (PartitionInfo& partition : *partitions) {
    if (!partition.reachable && partition.compatible()) all.absent.push_back(std::move(partition));
  }
  return all;
}

void warn(const Structure& structure, const Arguments& arguments) {
  if (!arguments.json) std::fputs(structure.warnings().c_str(), stderr);
}

}  // namespace

int run_tree(Source source, const Arguments& arguments) {
  Screen screen;
  do {
    const auto all = structure_of(source);
    if (!all) return report(all.error(), arguments);
    if (!arguments.watch) {
      const int status = none_there(source, arguments, !all->frames.empty());
      if (status != kDone) return status;
    }
    const std::string tree = draw_tree(all->frames, all->absent_names());
    if (arguments.json || !arguments.watch) {
      (void)answer(arguments, {{"frames", all->json()}}, tree);
      warn(*all, arguments);
    } else {
      screen.redraw(tree.empty() ? nobody_answers(arguments) + "\n" : tree + all->warnings());
    }
  } while (arguments.watch && !interrupted_within(1.0 / arguments.rate));
  return kDone;
}

int run_frames(Source source, const Arguments& arguments) {
  const auto all = structure_of(source);
  if (!all) return report(all.error(), arguments);
  if (const int status = none_there(source, arguments, !all->frames.empty()); status != kDone)
    return status;
  std::string text;
  for (const Frame& frame : all->frames) text += frame.id + "\n";
  const int status = answer(arguments, {{"frames", all->json()}}, text);
  warn(*all, arguments);
  return status;
}

int run_partitions(Client& client, const Arguments& arguments) {
  const auto partitions = client.partitions();
  if (!partitions) return report(partitions.error(), arguments);
  if (const int status = none_there(client, arguments, !partitions->empty()); status != kDone) {
    return status;
  }
  nlohmann::json json = nlohmann::json::array();
  std::vector<PartitionRow> rows;
  for (const PartitionInfo& partition : *partitions) {
    json.push_back(partition_json(partition));
    rows.push_back({partition, std::nullopt});
    if (!partition.reachable) continue;
    if (const auto histories = client.histories(partition.name)) {
      const HistorySum sum = sum_of(*histories);
      json.back()["moving"] = sum.edges;
      json.back()["samples"] = sum.samples;
      json.back()["history_bytes"] = sum.bytes;
      rows.back().history = sum;
    }
  }
  return answer(arguments, {{"partitions", json}}, partition_table(rows));
}

int run_add(Client& client, const Arguments& arguments) {
  const auto X_PC = arguments.spec.build();
  if (!X_PC) return refuse_pose(X_PC.error(), arguments);
  const auto added = client.add(arguments.id, arguments.parent, *X_PC, arguments.partition);
  return finish(client, added, arguments, "added");
}

// The parts that the options give.
Result<PartialTransform> given_parts(const TransformSpec& spec) {
  const auto X_PC = spec.build();
  if (!X_PC) return tl::unexpected(X_PC.error());
  PartialTransform given;
  if (spec.xyz || spec.matrix) given.translation = X_PC->pose.translation();
  if (spec.gives_rotation()) given.rotation = X_PC->pose.rotation();
  if (spec.gives_covariance()) given.covariance = X_PC->covariance;
  return given;
}

int run_update(Client& client, const Arguments& arguments) {
  const auto given = given_parts(arguments.spec);
  if (!given) return refuse_pose(given.error(), arguments);
  const auto stamp = optional_stamp(client, arguments.stamp);
  if (!stamp) return report(stamp.error(), arguments);
  const auto updated = client.update_partial({{arguments.id, *given}}, *stamp);
  return finish(client, updated, arguments, "updated");
}

int run_remove(Client& client, const Arguments& arguments) {
  const auto removed = client.remove(arguments.id);
  return finish(client, removed, arguments, "removed");
}

int run_forget(Client& client, const Arguments& arguments) {
  const auto forgotten = client.forget(arguments.id);
  return finish(client, forgotten, arguments, "forgotten");
}

int run_move(Client& client, const Arguments& arguments) {
  const auto given = given_parts(arguments.spec);
  if (!given) return refuse_pose(given.error(), arguments);
  const auto moved = client.move(arguments.id, arguments.parent, *given);
  return finish(client, moved, arguments, "moved");
}

int run_parent(Client& client, const Arguments& arguments) {
  const auto parent = client.parent(arguments.id);
  if (!parent) return refuse(client, parent.error(), arguments);
  const auto json = parent->empty() ? nlohmann::json() : nlohmann::json(*parent);
  return answer(arguments, {{"id", arguments.id}, {"parent", json}},
                (parent->empty() ? "(root)" : *parent) + "\n");
}

int run_children(Client& client, const Arguments& arguments) {
  const auto children = client.children(arguments.id);
  if (!children) return refuse(client, children.error(), arguments);
  return list(arguments, "children", *children);
}

int run_roots(Client& client, const Arguments& arguments) {
  const auto roots = client.roots();
  if (!roots) return report(roots.error(), arguments);
  if (const int status = none_there(client, arguments, !roots->empty()); status != kDone)
    return status;
  return list(arguments, "roots", *roots);
}

int run_exists(Client& client, const Arguments& arguments) {
  const auto parent = client.parent(arguments.id);
  if (!parent && !is_unknown(parent.error().code)) {
    return refuse(client, parent.error(), arguments);
  }
  const bool exists = parent.has_value();
  if (const int status = none_there(client, arguments, exists); status != kDone) return status;
  answer(arguments, {{"id", arguments.id}, {"exists", exists}}, exists ? "yes\n" : "no\n");
  return exists ? kDone : kRefused;
}

void print_event(const Change& change, const Arguments& arguments) {
  print(arguments.json ? dump(change_json(change)) + "\n"
                       : to_string(change.time) + "  " + change.message + "\n");
}

int run_events(Client& client, const Arguments& arguments) {
  // Completes discovery first, so that partitions that exist already are no events.
  const auto partitions = client.partitions();
  if (!partitions || partitions->empty()) {
    const std::string why = partitions ? nobody_answers(arguments) : partitions.error().message;
    std::fprintf(stderr, "tfdude: %s\n", why.c_str());
  }
  const auto subscription =
      client.on_change([&](const Change& change) { print_event(change, arguments); });
  const sigset_t stop_signals = signals_to_stop();
  int signal = 0;
  sigwait(&stop_signals, &signal);
  return kDone;
}

}  // namespace tfdude::cli
