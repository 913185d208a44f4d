#include "answer.hpp"

#include <cstdio>
#include <ctime>
#include <string_view>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "../rendering/json.hpp"
#include "../rendering/terminal.hpp"
#include "../stop_signals.hpp"

namespace tfdude::cli {
namespace {

void print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

void print_error(std::string_view code, std::string_view message) {
  print(dump({{"error", {{"code", code}, {"message", message}}}}) + "\n");
}

// Whether there is any partition.
Result<void> find_partition(Source source, const Common& common) {
  const auto partitions = source.partitions();
  if (!partitions) return tl::unexpected(partitions.error());
  if (!partitions->empty()) return {};
  if (!source.live()) return fail(Errc::kUnknownPartition, "the recording has no partition then");
  return fail(Errc::kUnreachable, nobody_answers(common));
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
  print_error("usage", message);
  return kWrongUsage;
}

int report(const Error& error, const Common& common) {
  if (common.json) {
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
      return kRejected;
  }
}

int report_cause(Source source, const Error& failed, const Common& common) {
  const Error error = cause_of(source, failed, common);
  if (error.code == Errc::kUnsupported && common.options.follow) return kNeedsAllFrames;
  return report(error, common);
}

Error cause_of(Source source, const Error& error, const Common& common) {
  if (!is_unknown(error.code)) return error;
  const auto found = find_partition(source, common);
  return found ? error : found.error();
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
