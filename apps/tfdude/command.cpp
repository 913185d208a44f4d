#include "command.hpp"

#include "tfdude/recording/recording.hpp"

#include "answer.hpp"
#include "options.hpp"
#include "stamps.hpp"

namespace tfdude::cli {

int LiveCommand::run(const Common& given) const {
  Common common = given;
  if (single_frames) common.options.follow.emplace();
  for (;;) {
    auto client = Client::open(common.options);
    if (!client) {
      (void)report(client.error(), common);
      return kWrongUsage;
    }
    const int status = ask(*client, common);
    if (status != kNeedsAllFrames) return status;
    common.options.follow.reset();
  }
}

void RecordableCommand::add_recording(CLI::App& app) {
  auto* option = app.add_option("--recording", recording,
                                "ask this file of tfdude record instead of the live system");
  option->type_name("FILE");
  if (app.get_option_no_throw("--at") != nullptr) return;
  add_stamp(app, "--at", at,
            "with --recording, the instant: seconds since the epoch or, negative, before its end")
      ->needs(option);
}

int RecordableCommand::run(const Common& common) const {
  if (recording.empty()) return LiveCommand::run(common);
  auto opened = Recording::open(recording);
  return opened ? ask_recording(*opened, common) : report(opened.error(), common);
}

int Question::ask(Client& client, const Common& common) const { return ask_source(client, common); }

int Question::ask_recording(Recording& recorded, const Common& common) const {
  Source source(recorded);
  const auto instant = optional_stamp(source, at);
  if (!instant) return report(instant.error(), common);
  if (*instant) source.go_to(**instant);
  return ask_source(source, common);
}

}  // namespace tfdude::cli
