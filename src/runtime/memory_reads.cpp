#include "runtime/memory_reads.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"

namespace tfdude {
namespace {

// How often an owner is asked again whose memory is read. To DDS this process then depends on the
// owner, and notices if it hangs, as if it had been asked for each lookup.
constexpr std::chrono::milliseconds kRenewAfter{1000};

// How long their answers are waited for.
constexpr std::chrono::milliseconds kAnswersIn{500};

// When an owner is asked again that could not be read.
constexpr std::chrono::seconds kRetryAfter{30};

// By how much later those may notice a death who do not read the memory: when they look, after the
// longest silence that DDS allows.
constexpr std::chrono::milliseconds kNoticedLater{2300};

}  // namespace

MemoryReads::MemoryReads(const Context& context, ProcessMemory& memory)
    : structure_(context.structure),
      member_(context.member),
      requests_(context.requests),
      memory_(memory),
      // A client that follows only some frames has no structure to walk.
      reads_(memory.port != nullptr && !context.options.follow),
      timeout_(context.options.timeout),
      job_(context.threads.asking, [this] { return run(); }) {}

void MemoryReads::stop() {
  job_.stop();
  std::unique_ptr<SharedMemory> port;
  const Lock lock(offer_mutex_);
  offer_.emplace();
  port = std::move(memory_.port);
}

// ---- reading

void MemoryReads::asked(const std::vector<Part>& parts) {
  if (!reads_) return;
  bool news = false;
  {
    const Lock lock(mutex_);
    for (const Part& part : parts) {
      if (part.owner == kHeldHere) continue;
      const auto [known, is_new] = owners_.try_emplace(part.owner);
      const bool again = known->second.state == Known::State::kRefused &&
                         Clock::now() - known->second.since > kRetryAfter;
      if (again) known->second = Known{};
      news = news || is_new || again;
    }
  }
  if (news) job_.ask();
}

void MemoryReads::find_all() {
  if (!reads_) return;
  {
    const Lock lock(structure_.mutex);
    const Lock owners(mutex_);
    for (const Owner owner : structure_.directory.reachable_owners()) owners_.try_emplace(owner);
  }
  attach_wanted();
}

Loop::Clock::time_point MemoryReads::run() {
  attach_wanted();
  if (edges_.take_used()) renew();
  return edges_.any() ? Clock::now() + kRenewAfter : Loop::kNever;
}

void MemoryReads::attach_wanted() {
  const Lock attaching(attaching_);
  std::vector<Owner> wanted;
  {
    const Lock lock(mutex_);
    for (const auto& [owner, known] : owners_) {
      if (known.state == Known::State::kWanted) wanted.push_back(owner);
    }
  }
  for (const Owner owner : wanted) attach(owner);
}

Result<MemoryOffer> MemoryReads::offer_of(const std::string& partition) {
  auto offer = requests_.ask_partition<MemoryOffer>(partition, MemoryRequest{},
                                                    Deadline(std::min(timeout_, kAnswersIn)));
  if (!offer) return tl::unexpected(std::move(offer.error()));
  if (*offer) return **std::move(offer);
  return fail(Errc::kUnsupported, "it gave another answer than that it was asked for");
}

void MemoryReads::attach(Owner owner) {
  std::string name;
  std::optional<Presence> serving;
  {
    const Lock lock(structure_.mutex);
    name = structure_.directory.name(owner);
    if (structure_.directory.reachable(owner)) serving = structure_.directory.serving(name);
  }
  if (!serving) return note(owner, std::nullopt);
  const std::uint64_t incarnation = serving->incarnation;
  const auto refused = [&](const Error& why) {
    const bool for_good = why.code == Errc::kUnsupported || why.code == Errc::kNotPermitted;
    if (!for_good) return note(owner, std::nullopt);
    log().debug("partition {} is asked over DDS: {}", quote(name), why.message);
    note(owner, Known{Known::State::kRefused, incarnation, why.message, Clock::now()});
  };
  const auto offer = offer_of(name);
  if (!offer) return refused(offer.error());
  if (offer->incarnation != incarnation) return note(owner, std::nullopt);
  const auto over = std::make_shared<std::atomic<bool>>(false);
  auto memory = memory_.port->attach(*offer, layout_hash(), [=](bool died) {
    over->store(true);
    end(owner, incarnation, died);
  });
  if (!memory) return refused(memory.error());
  const auto forest = RemoteForest::open(memory->at.get(), memory->size);
  if (!forest) return refused(forest.error());
  edges_.attach(owner, *forest, std::move(memory->at));
  note(owner, Known{Known::State::kAttached, incarnation, {}, Clock::now()});
  if (over->load()) end(owner, incarnation, false);
  // The owner may have been lost meanwhile.
  look_again();
}

void MemoryReads::note(Owner owner, std::optional<Known> known) {
  const Lock lock(mutex_);
  if (known) {
    owners_[owner] = *std::move(known);
  } else {
    owners_.erase(owner);
  }
}

// What they answer does not matter: an owner that hangs gives none.
void MemoryReads::renew() {
  std::vector<Part> parts;
  {
    const Lock lock(structure_.mutex);
    const Lock owners(mutex_);
    for (const auto& [owner, known] : owners_) {
      if (known.state != Known::State::kAttached) continue;
      const std::string& name = structure_.directory.name(owner);
      parts.push_back({owner, name, Request{0, name, MemoryRequest{}}});
    }
  }
  if (!parts.empty()) (void)requests_.ask(parts, Deadline(std::min(timeout_, kAnswersIn)));
}

void MemoryReads::look_again() {
  if (!reads_) return;
  std::vector<Owner> gone;
  bool other_clocks = false;
  {
    const Lock lock(structure_.mutex);
    const Lock owners(mutex_);
    for (auto known = owners_.begin(); known != owners_.end();) {
      const auto& [owner, state] = *known;
      const Directory& directory = structure_.directory;
      const auto serving =
          directory.reachable(owner) ? directory.serving(directory.name(owner)) : std::nullopt;
      const bool same = serving && serving->incarnation == state.incarnation;
      if (same && state.state == Known::State::kAttached) {
        other_clocks = other_clocks || clock_of(*serving) != structure_.clock.kind();
      }
      if (same || state.state == Known::State::kWanted) {
        ++known;
        continue;
      }
      gone.push_back(owner);
      known = owners_.erase(known);
    }
    other_clocks_.store(other_clocks, std::memory_order_relaxed);
    for (const Owner owner : gone) edges_.detach(owner);
  }
}

void MemoryReads::end(Owner owner, std::uint64_t incarnation, bool died) {
  {
    const Lock lock(mutex_);
    const auto known = owners_.find(owner);
    if (known != owners_.end() && known->second.incarnation == incarnation) {
      owners_.erase(known);
      edges_.detach(owner);
    }
  }
  if (!died) return;
  std::string name;
  {
    const Lock lock(structure_.mutex);
    name = structure_.directory.name(owner);
  }
  member_.on_lost(name, incarnation, kNoticedLater);
}

void MemoryReads::tell(std::vector<PartitionInfo>& partitions) const {
  const Lock lock(structure_.mutex);
  const Lock owners(mutex_);
  for (PartitionInfo& one : partitions) {
    const auto owner = structure_.directory.owner(one.name);
    if (!owner || *owner == kHeldHere) continue;
    const auto known = owners_.find(*owner);
    if (!reads_) {
      one.why_not_in_memory = memory_.port == nullptr ? "it is switched off here"
                                                      : "this client follows only some frames";
    } else if (known == owners_.end() || known->second.state == Known::State::kWanted) {
      one.why_not_in_memory = "none of its frames was looked up yet";
    } else if (known->second.state == Known::State::kAttached) {
      one.in_memory = true;
    } else {
      one.why_not_in_memory = known->second.why_not;
    }
  }
}

// ---- being read

Reply MemoryReads::answer(const Request& request, std::uint64_t incarnation) {
  const Lock lock(offer_mutex_);
  if (!offer_) {
    MemoryOffer nowhere;
    nowhere.why_not = memory_.why_not;
    if (memory_.arena == nullptr || memory_.port == nullptr) {
      offer_ = nowhere;
    } else {
      auto offered = memory_.port->offer(layout_hash());
      if (!offered) nowhere.why_not = offered.error().message;
      offer_ = offered ? *std::move(offered) : nowhere;
    }
  }
  Reply reply{request.sequence, 0, *offer_};
  std::get<MemoryOffer>(reply.body).incarnation = incarnation;
  return reply;
}

}  // namespace tfdude
