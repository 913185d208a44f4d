#include <cstdio>

#include "tfdude/recording/recording.hpp"

#include "../../rendering/json.hpp"
#include "../../stop_signals.hpp"
#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Events final : RecordableCommand {
  explicit Events(CLI::App& app) {
    until_interrupted = true;
    add_recording(app);
  }

  int ask(Client& client, const Common& common) const override {
    // Completes discovery first, so that partitions that exist already are no events.
    warn_without(client.partitions(), common);
    const auto subscription =
        client.on_change([&](const Change& change) { print(change, common); });
    const sigset_t signals = stop_signals();
    int signal = 0;
    sigwait(&signals, &signal);
    return kDone;
  }

  int ask_recording(Recording& recorded, const Common& common) const override {
    const auto from = beginning(recorded, at);
    if (!from) return report(from.error(), common);
    recorded.events(*from, [&](const Change& change) {
      print(change, common);
      return true;
    });
    return kDone;
  }

  static void print(const Change& change, const Common& common) {
    (void)answer(common, change_json(change),
                 to_string(change.time) + "  " + change.message + "\n");
  }
};

}  // namespace

void add_events(Commands& commands) {
  commands.add<Events>("events", "print changes: partitions that come and go, frames, conflicts",
                       "--json events");
}

}  // namespace tfdude::cli
