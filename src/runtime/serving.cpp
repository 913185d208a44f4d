#include "runtime/serving.hpp"

#include <array>
#include <optional>
#include <random>
#include <set>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "base/mutex.hpp"
#include "partition/claiming.hpp"
#include "partition/reconfigure.hpp"
#include "runtime/wall_clock.hpp"
#include "store/sqlite_store.hpp"

namespace tfdude {
namespace {

using Clock = std::chrono::steady_clock;

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
}

// Logs the changes of a configuration to the stored state; none before the first configuration.
// Orphans are reported as events, with those of other partitions.
void log_configured(const StoredState& state, const std::vector<FrameSpec>& frames) {
  if (state.configured.empty() && state.frames.empty()) return;
  for (const ConfiguredChange& change : configured_changes(state, frames)) {
    if (change.kind == ConfiguredChange::Kind::kOrphan) continue;
    const bool loses = change.kind == ConfiguredChange::Kind::kRemove ||
                       change.kind == ConfiguredChange::Kind::kRest;
    log().log(loses ? spdlog::level::warn : spdlog::level::info, "configuration: {}",
              describe(change));
  }
}

}  // namespace

Result<void> Serving::serve(const std::vector<FrameSpec>& frames) {
  std::random_device device;
  member_.with_rules([&](Member& member) {
    member.claim(host_name(), static_cast<std::uint32_t>(getpid()), wall_clock(), device());
    if (structure_.clock.kind() == ClockKind::kExternal) member.use_external_clock();
  });
  if (auto claimed = claim_name(); !claimed) return claimed;
  if (auto taken = take_frames(frames); !taken) return taken;
  if (auto serving = transport_.serve(member_.name()); !serving) return serving;
  if (auto stored = member_.publish_all(); !stored) return stored;
  member_.introduce();
  return {};
}

Result<void> Serving::claim_name() {
  member_.introduce();
  Claiming::Patience patience;
  patience.meeting = std::chrono::ceil<Milliseconds>(transport_.discovery_time());
  auto claiming = member_.with_rules(
      [&](const Member& member) { return Claiming(member.name_claim(), patience, Clock::now()); });
  while (true) {
    const bool awaits_presence = transport_.awaits_presence();
    std::optional<Presence> rival;
    const Claiming::Step step = member_.with_rules([&](Member& member) {
      const Claiming::Step next = claiming.next(Clock::now(), awaits_presence);
      if (next == Claiming::Step::kTake) member.take_name();
      rival = member.name_claim().rival();
      return next;
    });
    if (step == Claiming::Step::kServe) return {};
    if (step == Claiming::Step::kTake) member_.introduce();
    if (step == Claiming::Step::kWait) discovery_.wait_for_change();
    if (step != Claiming::Step::kLeave) continue;
    member_.say_goodbye();
    const std::string who =
        rival ? ", on host " + rival->host + " by process " + std::to_string(rival->pid) : "";
    return fail(Errc::kPartitionTaken,
                "partition " + quote(member_.name()) + " is served already" + who);
  }
}

Result<StoredState> Serving::open_store(std::unique_ptr<StateStore>& store) {
  auto opened =
      open_sqlite_store(state_file(options_.state, options_.domain, member_.name()), member_.name(),
                        options_.sync ? StoreSync::kEachChange : StoreSync::kAtCheckpoints);
  if (!opened) return tl::unexpected(std::move(opened.error()));
  store = *std::move(opened);
  return store->load();
}

Result<void> Serving::take_frames(const std::vector<FrameSpec>& frames) {
  if (auto set = structure_.forest.set_default_timing(options_.history); !set) return set;
  StoredState state;
  std::unique_ptr<StateStore> store;
  if (!options_.state.empty()) {
    auto stored = open_store(store);
    if (!stored) return tl::unexpected(std::move(stored.error()));
    state = *std::move(stored);
  }
  const bool kept = store != nullptr;
  member_.open(std::move(store), options_.save_every);
  // The stored state is compared with what the others own now.
  const auto incomplete = [this] {
    if (transport_.awaits_presence()) return true;
    const Lock lock(structure_.mutex);
    return !structure_.directory.complete();
  };
  const bool any = !state.frames.empty() || !frames.empty();
  while (any && Clock::now() < discovery_.met_by() && incomplete()) discovery_.wait_for_change();
  if (any) await_gone();
  if (auto taken = member_.serve(kept ? &state : nullptr, frames); !taken) return taken;
  limit_history();
  {
    const Lock lock(structure_.mutex);
    member_.partition()->limit_frames(options_.limits.frames);
  }
  log_configured(state, frames);
  return set_timings(frames, left_static(state, frames));
}

void Serving::limit_history() {
  const std::size_t bytes = options_.limits.history_bytes;
  structure_.forest.limit_history(bytes, [name = member_.name(), bytes] {
    log().warn(
        "partition {}: the samples of its edges take {} bytes, the limit (--max-history). From now "
        "on the oldest ones are dropped for new ones",
        quote(name), bytes);
  });
}

Result<void> Serving::set_timings(const std::vector<FrameSpec>& frames,
                                  const std::set<std::string>& left_static) {
  for (const FrameSpec& frame : frames) {
    const bool declared = frame.timing || options_.history.moving;
    // A frame removed by request has no edge to set.
    if (!declared || !structure_.forest.holds(frame.id)) continue;
    EdgeTiming timing = frame.timing ? *frame.timing : options_.history;
    if (left_static.count(frame.id) != 0) timing.moving = false;
    auto set = structure_.forest.set_timing(frame.id, timing);
    // One that is being handed over has that of its former owner.
    if (!set && set.error().code != Errc::kNotOwner) return set;
  }
  return {};
}

// Waits until silent partitions are back or gone, which decides who owns contested frames. A
// returning partition yields only to those that count it as gone: otherwise changes that this
// process acknowledges in its first moments could be lost.
void Serving::await_gone() {
  const auto patience = Clock::now() + 3 * Absences::kGrace;
  const auto undecided = [this] {
    const Lock lock(structure_.mutex);
    return structure_.directory.awaits_silent();
  };
  while (Clock::now() < patience && undecided()) discovery_.wait_for_change();
}

}  // namespace tfdude
