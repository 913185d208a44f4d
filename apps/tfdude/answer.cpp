#include "answer.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <optional>
#include <string_view>
#include <unistd.h>

#include "tfdude/base/id.hpp"
#include "tfdude/base/similar.hpp"

#include "../numbers.hpp"
#include "../rendering/json.hpp"
#include "../rendering/terminal.hpp"
#include "../rendering/text.hpp"
#include "../standard_output.hpp"
#include "../stop_signals.hpp"

namespace tfdude::cli {
namespace {

void print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  flush_or_end();
}

nlohmann::json error_json(const Error& error) {
  nlohmann::json json{{"code", to_string(error.code)}, {"message", error.message}};
  if (!error.frame.empty()) json["frame"] = error.frame;
  if (!error.partition.empty()) json["partition"] = error.partition;
  if (error.available) {
    json["available_ns"] = {nanoseconds(error.available->from),
                            nanoseconds(error.available->until)};
  }
  return json;
}

// Whether there is any partition.
Result<void> find_partition(Source source, const Common& common) {
  const auto partitions = source.partitions();
  if (!partitions) return tl::unexpected(partitions.error());
  if (!partitions->empty()) return {};
  if (!source.live()) return fail(Errc::kUnknownPartition, "the recording has no partition then");
  return fail(Errc::kUnreachable, nobody_answers(common));
}

// Whether the command line has --at 0, which means the newest in tf2.
bool asks_for_zero(const Common& common) {
  constexpr std::string_view kOption = "--at";
  for (char** typed = common.argv; typed != nullptr && *typed != nullptr; ++typed) {
    const std::string_view word = *typed;
    const bool same = word.substr(0, word.find('=')) == kOption;
    const char* value = !same                          ? nullptr
                        : word.size() > kOption.size() ? *typed + kOption.size() + 1
                                                       : typed[1];
    if (value != nullptr && to_number(value) == 0) return true;
  }
  return false;
}

// Of a source that knows only some frames, another one that knows all.
Result<Client> open_for_all(const Common& common) {
  const Options& options = common.options;
  return Client::open(options);
}

// The frame that the joint of this name moves.
std::optional<std::string> moved_by(Source source, const std::string& joint) {
  const auto partitions = source.partitions();
  if (!partitions) return std::nullopt;
  for (const PartitionInfo& partition : *partitions) {
    if (!partition.reachable) continue;
    const auto joints = source.joints(partition.name);
    if (!joints) continue;
    for (const JointInfo& one : *joints) {
      if (one.name == joint) return one.frame;
    }
  }
  return std::nullopt;
}

// Which frame was probably meant by the id that no frame has; empty: nothing is like it.
std::string what_was_meant(Source source, const Error& error, const Common& common) {
  const std::string id =
      error.frame.empty() ? error_of_text(error.code, error.message).frame : error.frame;
  if (id.empty()) return {};
  if (source.live() && common.options.follow) {
    auto all = open_for_all(common);
    Common other = common;
    other.options.follow.reset();
    return all ? what_was_meant(*all, error, other) : std::string();
  }
  if (const auto frame = moved_by(source, id)) {
    return quote(id) + " is a joint, which moves frame " + quote(*frame);
  }
  const auto frames = source.frames();
  if (!frames) return {};
  std::vector<std::string> ids;
  for (const Frame& frame : *frames) ids.push_back(frame.id);
  const auto similar = similar_names(id, ids);
  return similar.empty() ? "" : "did you mean " + joined(similar) + "?";
}

// That the clock by which ages in a message were found is not the one here; empty: it does not
// differ.
std::string clock_of(Source source, const std::string& partition, const Common& common) {
  if (partition.empty() || common.options.clock != ClockKind::kSystem) return {};
  const auto difference = source.clock_difference(partition);
  const bool differs = difference && difference->exceeds(kClockDiffers);
  return differs ? clock_hint(partition, difference->ahead) : "";
}

}  // namespace

int answer(const Common& common, const nlohmann::json& json, const std::string& text) {
  print(common.json ? dump(json) + "\n" : text);
  return kDone;
}

int answer_list(const Common& common, const char* key, const std::vector<std::string>& ids) {
  std::string text;
  for (const std::string& id : ids) text += id + "\n";
  return answer(common, {{key, ids}}, text);
}

int answer_done(Client& client, const Common& common, const Result<void>& changed, const char* what,
                const std::string& id) {
  if (!changed) return report_cause(client, changed.error(), common);
  return answer(common, {{"done", what}, {"id", id}}, std::string(what) + " " + id + "\n");
}

int report_usage(const std::string& message) {
  print(dump({{"error", {{"code", "usage"}, {"message", message}}}}) + "\n");
  return kWrongUsage;
}

int report(const Error& error, const Common& common) {
  if (common.json) {
    print(dump({{"error", error_json(error)}}) + "\n");
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
      return kRejected;
  }
}

int report_cause(Source source, const Error& failed, const Common& common) {
  const Error error = cause_of(source, failed, common);
  if (error.code == Errc::kUnsupported && common.options.follow) return kNeedsAllFrames;
  return report(with_hint(source, error, common), common);
}

Error cause_of(Source source, const Error& error, const Common& common) {
  if (!is_unknown(error.code)) return error;
  const auto found = find_partition(source, common);
  return found ? error : found.error();
}

Error with_hint(Source source, Error error, const Common& common) {
  std::string hint;
  if (error.code == Errc::kTooOld && asks_for_zero(common)) {
    hint = "0 is an instant, too: leave --at out for the newest";
  } else if (is_unknown(error.code)) {
    hint = what_was_meant(source, error, common);
  } else if (error.code == Errc::kNotYet || error.code == Errc::kTooOld) {
    hint = clock_of(source, error.partition, common);
  }
  if (!hint.empty()) error.message += "; " + hint;
  return error;
}

int check_partitions(Source source, const Common& common, bool found) {
  if (found) return kDone;
  const auto any = find_partition(source, common);
  return any ? kDone : report(any.error(), common);
}

std::string profile_of(const Options& options) {
  if (options.profile.empty()) return "the built-in profile";
  return "profile " + quote(options.profile);
}

std::string nobody_answers(const Common& common) {
  return "no partition answers in domain " + std::to_string(common.options.domain) + " with " +
         profile_of(common.options) +
         ": all participants must use the same domain, profile and discovery server";
}

void warn_without(const Result<std::vector<PartitionInfo>>& partitions, const Common& common,
                  const char* more) {
  if (partitions && !partitions->empty()) return;
  const std::string why = partitions ? nobody_answers(common) : partitions.error().message;
  std::fprintf(stderr, "tfdude: %s%s\n", why.c_str(), more);
}

bool interrupted_within(double seconds) {
  const sigset_t signals = stop_signals();
  const auto whole = static_cast<std::time_t>(seconds);
  const timespec pause{whole, static_cast<long>((seconds - static_cast<double>(whole)) * 1e9)};
  return sigtimedwait(&signals, nullptr, &pause) >= 0;
}

}  // namespace tfdude::cli
