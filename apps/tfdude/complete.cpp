#include "complete.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string_view>
#include <thread>
#include <unistd.h>

#include "tfdude/client/client.hpp"

#include "../exit_status.hpp"
#include "../network_options.hpp"
#include "../numbers.hpp"
#include "../standard_output.hpp"

namespace tfdude::cli {
namespace {

bool begins_with(const std::string& text, std::string_view beginning) {
  return text.rfind(beginning, 0) == 0;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

bool is_of(const CLI::App& command, std::string_view group) {
  for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
    if (app->get_name() == group) return true;
  }
  return false;
}

Completed kind_of(const CLI::App& command, const std::string& name) {
  static const std::map<std::string, Completed, std::less<>> kKinds = {
      {"A", Completed::kFrames},
      {"B", Completed::kFrames},
      {"ID", Completed::kFrames},
      {"--parent", Completed::kFrames},
      {"--fixed", Completed::kFrames},
      {"--root", Completed::kFrames},
      {"FRAME", Completed::kFrames},
      {"--in", Completed::kFrames},
      {"PARTITION", Completed::kPartitions},
      {"--partition", Completed::kPartitions},
      {"--to-owner", Completed::kPartitions},
      {"--into", Completed::kPartitions},
      {"FILE", Completed::kFiles},
      {"--out", Completed::kFiles},
      {"--profile", Completed::kFiles},
      {"--recording", Completed::kFiles},
      {"--covariances", Completed::kFiles},
      {"--from", Completed::kFiles},
      {"DIR", Completed::kDirectories},
      {"--keys", Completed::kDirectories},
  };
  // A new frame's id, and what is asked of a key store, are not names of the live system.
  if (command.get_name() == "add" && name == "ID") return Completed::kNothing;
  if (command.get_name() == "joint" && name == "JOINTS") return Completed::kJoints;
  const auto found = kKinds.find(name);
  if (found == kKinds.end()) return Completed::kNothing;
  if (is_of(command, "keys") && found->second == Completed::kPartitions) return Completed::kNothing;
  return found->second;
}

// The words that an option accepts, if its help lists them as "{a,b}".
std::vector<Candidate> accepted(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto begin = type.find('{');
  const auto end = type.find('}');
  std::vector<Candidate> words;
  if (begin == std::string::npos || end == std::string::npos) return words;
  for (std::size_t at = begin + 1; at < end;) {
    const std::size_t comma = std::min(type.find(',', at), end);
    words.push_back({type.substr(at, comma - at), ""});
    at = comma + 1;
  }
  return words;
}

Completion values_of(const CLI::App& command, const CLI::Option& option) {
  if (auto words = accepted(option); !words.empty()) return {Completed::kWords, std::move(words)};
  return {kind_of(command, option.get_name(option.get_positional())), {}};
}

CLI::Option* option_of(CLI::App& command, const std::string& name) {
  for (CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
    if (auto* option = app->get_option_no_throw(name)) return option;
  }
  return nullptr;
}

Completion options_of(CLI::App& command) {
  Completion options{Completed::kWords, {}};
  for (CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
    // keys needs no participant.
    const bool network = app->get_parent() == nullptr && is_of(command, "keys");
    for (const CLI::Option* option : app->get_options({})) {
      if (option->get_positional() || option->get_group().empty()) continue;
      for (const std::string& name : option->get_lnames()) {
        if (network && name != "json") continue;
        if (name == "help" && app != &command) continue;
        options.words.push_back({"--" + name, first_line(option->get_description())});
      }
    }
  }
  return options;
}

Completion commands_of(const CLI::App& command) {
  Completion commands{Completed::kWords, {}};
  for (const CLI::App* one : command.get_subcommands([](const CLI::App*) { return true; })) {
    if (one->get_group().empty()) continue;
    commands.words.push_back({one->get_name(), first_line(one->get_description())});
  }
  return commands;
}

CLI::App* command_named(CLI::App& command, const std::string& name) {
  const auto found =
      command.get_subcommands([&](const CLI::App* one) { return one->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

// The positional argument after so many others; the last one may be repeated.
Completion positional_of(const CLI::App& command, std::size_t before) {
  std::vector<const CLI::Option*> positional;
  for (const CLI::Option* option : command.get_options({})) {
    if (option->get_positional()) positional.push_back(option);
  }
  if (positional.empty()) return {};
  const bool repeated = positional.back()->get_items_expected_max() > 1;
  if (before >= positional.size() && !repeated) return {};
  return values_of(command, *positional[std::min(before, positional.size() - 1)]);
}

// Reads the words of a command line from left to right, as far as they say what may follow.
class Reader {
 public:
  explicit Reader(CLI::App& app) : command_(&app) {}

  void read(const std::string& word) {
    if (word == "=") return;  // bash splits "--domain=5"
    if (values_left_ > 0 && (!is_option(word) || is_number(word))) {
      --values_left_;
    } else if (is_option(word)) {
      const auto equals = word.find('=');
      option_ = option_of(*command_, word.substr(0, equals));
      const bool given = option_ == nullptr || equals != std::string::npos;
      values_left_ = given ? 0 : option_->get_items_expected_min();
    } else if (auto* sub = command_named(*command_, word)) {
      command_ = sub;
      positional_ = 0;
    } else {
      ++positional_;
    }
  }

  [[nodiscard]] Completion next(const std::string& begun) const {
    if (values_left_ > 0 && !is_option(begun)) return values_of(*command_, *option_);
    if (is_option(begun)) return options_of(*command_);
    if (auto commands = commands_of(*command_); !commands.words.empty()) return commands;
    return positional_of(*command_, positional_);
  }

 private:
  static bool is_option(const std::string& word) { return begins_with(word, "-"); }

  CLI::App* command_;
  CLI::Option* option_ = nullptr;  // whose values are read
  int values_left_ = 0;
  std::size_t positional_ = 0;
};

// The network options among the words. Others are not wrong here.
Options options_among(const std::vector<std::string>& words) {
  Options options;
  CLI::App app;
  app.allow_extras();
  add_network_options(app, options);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError&) {  // what stands there is being typed
  }
  return options;
}

std::vector<Candidate> names_of(Completed kind, Options options) {
  // Needed only if no partition answers: otherwise discovery is complete sooner.
  options.discovery = options.timeout = kCompletionTime / 2;
  auto client = Client::open(options);
  std::vector<Candidate> names;
  if (!client) return names;
  if (kind == Completed::kFrames) {
    for (Frame& frame : client->frames().value_or(std::vector<Frame>())) {
      names.push_back({std::move(frame.id), "frame of " + frame.partition});
    }
    return names;
  }
  std::map<std::string, std::vector<std::string>> partitions_of;  // by joint
  for (const PartitionInfo& partition :
       client->partitions().value_or(std::vector<PartitionInfo>())) {
    if (kind == Completed::kPartitions) {
      names.push_back({partition.name, "partition on " + partition.host});
      continue;
    }
    for (JointInfo& joint : client->joints(partition.name).value_or(std::vector<JointInfo>())) {
      partitions_of[std::move(joint.name)].push_back(partition.name);
    }
  }
  for (const auto& [joint, partitions] : partitions_of) {
    for (const std::string& partition : partitions) {
      const bool contested = partitions.size() > 1;
      names.push_back({contested ? partition + "/" + joint : joint, "joint of " + partition});
    }
  }
  return names;
}

void print(const std::vector<Candidate>& candidates, const std::string& begun) {
  for (const Candidate& one : candidates) {
    if (begins_with(one.word, begun)) std::printf("%s\t%s\n", one.word.c_str(), one.help.c_str());
  }
}

}  // namespace

Completion completion_after(CLI::App& app, const std::vector<std::string>& words,
                            const std::string& begun) {
  Reader reader(app);
  for (const std::string& word : words) reader.read(word);
  return reader.next(begun);
}

void complete(CLI::App& app, const std::vector<std::string>& words) {
  const auto last = words.empty() ? words.end() : words.end() - 1;
  const std::vector<std::string> before(words.begin(), last);
  const std::string begun = words.empty() ? "" : words.back();
  Completion completion = completion_after(app, before, begun);
  if (completion.kind == Completed::kFiles) std::puts(":files");
  if (completion.kind == Completed::kDirectories) std::puts(":directories");
  const bool names = completion.kind == Completed::kFrames ||
                     completion.kind == Completed::kPartitions ||
                     completion.kind == Completed::kJoints;
  if (names) {
    log_fastdds_to_standard_error();
    // The shell waits for the answer: this process ends after kCompletionTime, whatever hangs.
    std::thread([] {
      std::this_thread::sleep_for(kCompletionTime);
      _exit(kDone);
    }).detach();
    completion.words = names_of(completion.kind, options_among(before));
  }
  print(completion.words, begun);
  _exit(status_with_output("tfdude", kDone));
}

}  // namespace tfdude::cli
