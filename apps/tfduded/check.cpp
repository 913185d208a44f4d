#include "check.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>
#include <utility>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"
#include "tfdude/client/client.hpp"
#include "tfdude/client/config_preview.hpp"
#include "tfdude/keys/key_files.hpp"

#include "../process.hpp"
#include "../standard_output.hpp"

namespace tfdude::daemon {
namespace {

using Change = ConfiguredChange::Kind;

std::string number_of(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

std::string profile_of(const Options& options) {
  return options.profile.empty() ? "the built-in profiles" : "profile " + quote(options.profile);
}

// The file of an entry of Config::places, which may have a line.
std::string file_of(const std::string& place) {
  const auto colon = place.rfind(':');
  const bool line = colon != std::string::npos && colon + 1 < place.size() &&
                    place.find_first_not_of("0123456789", colon + 1) == std::string::npos;
  return line ? place.substr(0, colon) : place;
}

// How many frames and joints each file describes.
void print_sources(const Config& config) {
  struct Count {
    std::size_t frames = 0;
    std::size_t joints = 0;
  };
  std::vector<std::pair<std::string, Count>> files;  // in the order of the configuration
  for (std::size_t i = 0; i < config.frames.size(); ++i) {
    const std::string file = file_of(config.places[i]);
    if (files.empty() || files.back().first != file) files.push_back({file, {}});
    ++files.back().second.frames;
    if (config.frames[i].joint) ++files.back().second.joints;
  }
  for (const auto& [file, count] : files) {
    std::printf("configured by %s: %s, %s\n", file.c_str(),
                number_of(count.frames, "frame").c_str(), number_of(count.joints, "joint").c_str());
  }
  if (files.empty()) std::puts("no frames configured: all stays as it was stored");
}

// The keys as a participant would use them. Prints until when they are valid.
Result<void> check_keys(const std::string& directory, const std::string& partition,
                        std::uint32_t domain) {
  if (directory.empty()) return {};
  const Time now = std::chrono::system_clock::now();
  const auto keys = find_keys(directory, now);
  if (!keys) return tl::unexpected(keys.error());
  const std::string identity = "keys " + directory + ": identity " + quote(keys->identity);
  if (keys->roles.serves != partition) {
    return fail(Errc::kNotPermitted,
                identity +
                    " is not the daemon of this partition: tfdude keys daemon makes its "
                    "keys");
  }
  const auto [first, last] = keys->settings.domains;
  if (domain < first || domain > last) {
    return fail(Errc::kNotPermitted, identity + " is valid in the domains " +
                                         std::to_string(first) + " to " + std::to_string(last) +
                                         ", not in " + std::to_string(domain));
  }
  const auto days = std::chrono::duration_cast<std::chrono::hours>(keys->until - now).count() / 24;
  std::printf("%s, valid until %s (%s)\n", identity.c_str(), to_string(keys->until).c_str(),
              number_of(static_cast<std::size_t>(days), "day").c_str());
  return {};
}

// What becomes of the stored state.
void print_state(const ConfigPreview& preview) {
  if (preview.file.empty()) {
    std::puts("nothing is stored, and nothing was: --no-state");
    return;
  }
  std::printf("state %s: %s\n", preview.file.c_str(), number_of(preview.frames, "frame").c_str());
  std::size_t kept = preview.frames;
  for (const ConfiguredChange& change : preview.changes) {
    std::printf("  %s\n", describe(change).c_str());
    if (change.kind == Change::kRemove || change.kind == Change::kReplace) --kept;
  }
  if (preview.changes.empty()) std::puts("  nothing changes");
  if (kept > 0) std::printf("  %s kept as stored\n", number_of(kept, "frame").c_str());
}

// What the partition needs of others.
void print_needs(const std::vector<Frame>& served) {
  std::map<std::string, std::vector<std::string>> needed;  // by the parents
  for (const Frame& frame : served) {
    if (!frame.attached && !frame.parent.empty()) needed[frame.parent].push_back(frame.id);
  }
  for (const auto& [parent, children] : needed) {
    std::string below;
    for (const std::string& child : children) below += (below.empty() ? "" : ", ") + quote(child);
    std::printf("needs %s of another partition, for %s\n", quote(parent).c_str(), below.c_str());
  }
}

}  // namespace

std::string unspecified_edges(const Config& config) {
  std::size_t all = 0;
  std::size_t fixed = 0;
  std::size_t moved = 0;
  for (const FrameSpec& frame : config.frames) {
    if (frame.parent.empty()) continue;
    ++all;
    if (!frame.X_PC.covariance.complete()) ++(frame.joint ? moved : fixed);
  }
  if (fixed + moved == 0) return {};
  std::string text = std::to_string(fixed + moved) + " of " + number_of(all, "edge") +
                     " without covariance, so no lookup over them has one";
  if (fixed > 0) {
    text +=
        ": write --covariance exact for --urdf, or covariance: exact in the configuration, if " +
        std::to_string(fixed) + " of them are known exactly, otherwise the stddev of each";
  }
  if (moved > 0) {
    text += "; " + number_of(moved, "joint") + (moved == 1 ? " has" : " have") +
            " none until the first sample with a variance, or give a stddev and sample_stddev";
  }
  return text;
}

std::vector<std::string> links_to_write(const Arguments& arguments, const Config& config) {
  if (config.urdfs.empty()) return {};
  const Options& joining = arguments.options;
  auto client = Client::open(joining);
  const auto frames = client ? client->frames() : Result<std::vector<Frame>>();
  if (!frames) return {};
  std::set<std::string> taken;
  for (const Frame& frame : *frames) {
    if (frame.partition != config.partition) taken.insert(frame.id);
  }
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < config.urdfs.size(); ++i) {
    const UrdfPart& part = config.urdfs[i];
    const auto left = urdf_without(part, taken);
    if (!left || (*left && (*left)->links == part.links)) continue;
    if (!*left) {
      lines.push_back("leave out " + quote(part.file) + ": others own all of its links");
      continue;
    }
    // Those of the command line come last.
    const bool typed = i + arguments.urdfs.size() >= config.urdfs.size();
    std::string links;
    for (const std::string& entry : (*left)->links) {
      links += (links.empty() ? "" : typed ? "," : ", ") + printable(entry);
    }
    std::string line = "write " + (typed ? "--links " + links : "links: [" + links + "]");
    if ((*left)->root != part.root) {
      line += typed ? " and no --root" : " and no root, nor a pose in it";
    }
    lines.push_back(line + " for " + quote(part.file));
  }
  return lines;
}

int check(const Arguments& arguments, const Config& config) {
  const NodeOptions& options = arguments.options;
  const auto preview = preview_config(config.partition, config.frames, options);
  if (!preview) {
    spdlog::error("partition {}: {}", quote(config.partition), preview.error().message);
    return cli::kWrongUsage;
  }
  std::printf("would serve partition %s in domain %u with %s: %s\n",
              quote(config.partition).c_str(), options.domain, profile_of(options).c_str(),
              number_of(preview->served.size(), "frame").c_str());
  print_sources(config);
  print_state(*preview);
  print_needs(preview->served);
  if (const std::string line = unspecified_edges(config); !line.empty()) std::puts(line.c_str());
  if (auto ok = check_keys(options.keys, config.partition, options.domain); !ok) {
    spdlog::error("{}", ok.error().message);
    return cli::kWrongUsage;
  }
  return cli::status_with_output("tfduded", cli::kDone);
}

}  // namespace tfdude::daemon
