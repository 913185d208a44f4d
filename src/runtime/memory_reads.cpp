#include "runtime/memory_reads.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "memory/waiting.hpp"
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

// How many owners that are gone are remembered; each takes the memory that it had.
constexpr std::size_t kMostGone = 8;

// How long those are let alone who wait for commits, while these come one after the other.
constexpr std::chrono::microseconds kWakeEvery{200};

}  // namespace

MemoryReads::MemoryReads(const Context& context, ProcessMemory& memory, Watchers watchers)
    : structure_(context.structure),
      member_(context.member),
      requests_(context.requests),
      memory_(memory),
      is_off_(memory.port == nullptr),
      // A client that follows only some frames has no structure to walk.
      reads_(!is_off_ && !context.options.follow),
      timeout_(context.options.timeout),
      watchers_(std::move(watchers)),
      job_(context.threads.asking, [this] { return run(); }),
      wake_job_(
          context.threads.push,
          [this] {
            wake_waiting(memory_.arena->roots().committed);
            return Loop::kNever;
          },
          kWakeEvery),
      waits_([this] { return watchers_.committed(); }) {}

void MemoryReads::stop() {
  waits_.stop();
  job_.stop();
  std::unique_ptr<SharedMemory> port;
  {
    const Lock attaching(attaching_);  // a callback may attach
    const Lock lock(offer_mutex_);
    offer_.emplace();
    port = std::move(memory_.port);
  }
  port.reset();
  set_waited(false);
  wake_job_.stop();
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
  const bool watched = kept_.take_used();
  if (edges_.take_used() || watched) renew();
  return edges_.any() ? Clock::now() + kRenewAfter : Loop::kNever;
}

void MemoryReads::attach_wanted() {
  const Lock attaching(attaching_);
  if (memory_.port == nullptr) return;  // stopped
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
  {
    // At once: drop_kept() takes what it finds in only one of them for that of an earlier process.
    const Lock lock(mutex_);
    edges_.attach(owner, *forest, memory->at);
    kept_.attach(owner, *forest, memory->at);
    memories_[owner] = {incarnation, std::make_shared<const RemoteForest>(*forest),
                        *std::move(memory)};
  }
  note(owner, Known{Known::State::kAttached, incarnation, {}, Clock::now()});
  if (over->load()) end(owner, incarnation, false);
  // The owner may have been lost meanwhile.
  look_again();
  watchers_.attached();
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
      const auto serving = structure_.directory.reachable(owner)
                               ? structure_.directory.serving(structure_.directory.name(owner))
                               : std::nullopt;
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
    drop_kept();
  }
}

void MemoryReads::drop_kept() {
  std::vector<Owner> gone;
  for (auto one = memories_.begin(); one != memories_.end();) {
    const Owner owner = one->first;
    const auto serving = structure_.directory.serving(structure_.directory.name(owner));
    if (serving && serving->incarnation != one->second.incarnation) {
      kept_.detach(owner);
      one = memories_.erase(one);
      continue;
    }
    // One that was silent and has returned is attached again only when somebody reads it.
    const auto known = owners_.find(owner);
    const bool there = structure_.directory.reachable(owner) ||
                       (known != owners_.end() && known->second.state == Known::State::kAttached);
    std::optional<Clock::time_point>& lost = one->second.lost;
    if (there) {
      lost.reset();
    } else {
      lost = lost.value_or(Clock::now());
      gone.push_back(owner);
    }
    ++one;
  }
  std::sort(gone.begin(), gone.end(), [&](Owner x, Owner y) TFDUDE_UNCHECKED_LOCKS {
    return memories_[x].lost < memories_[y].lost;
  });
  for (std::size_t i = 0; i + kMostGone < gone.size(); ++i) {
    kept_.detach(gone[i]);
    memories_.erase(gone[i]);
  }
}

bool MemoryReads::can_watch(const std::vector<Part>& parts) {
  if (!reads_ || parts.empty() || !can_wait_for_numbers()) return false;
  bool all = true;
  {
    const Lock lock(mutex_);
    for (const Part& part : parts) {
      const auto known = owners_.find(part.owner);
      const bool attached =
          known != owners_.end() && known->second.state == Known::State::kAttached;
      all = all && (part.owner == kHeldHere || attached);
    }
    // Those beyond could not be waited for.
    if (memories_.size() > MemoryWaits::kMostOwners) all = false;
  }
  if (!all) asked(parts);
  return all;
}

std::optional<Reply> MemoryReads::read(const Request& request) {
  const auto* asked = std::get_if<LookupRequest>(&request.body);
  // Of an observation more is needed than what is read; what was believed before is not in memory.
  if (asked == nullptr || asked->rows != Rows::kNone || !any()) return std::nullopt;
  if (asked->query.believed_at) return std::nullopt;
  const bool of_age = asked->query.age_noise_until.has_value();
  if (of_age && other_clocks_.load(std::memory_order_relaxed)) return std::nullopt;
  const Forest& forest = structure_.forest;
  const auto look = [&] {
    return forest.lookup_segments(asked->segments, asked->query, asked->hint, edges_, asked->edges,
                                  asked->timed ? asked->query.at : std::nullopt);
  };
  auto found = look();
  if (!found && found.error().code == Errc::kNotOwner) {
    const auto bound = [&](const PathEnds& one) {
      return forest.bind(one.from, one.to, edges_) > 0;
    };
    const bool all = std::all_of(asked->segments.begin(), asked->segments.end(), bound);
    if (all) found = look();
  }
  if (!found) return std::nullopt;
  return Reply{request.sequence, 0, *std::move(found)};
}

Result<StampedTransform> MemoryReads::last_known(const std::string& a, const std::string& b,
                                                 const Query& query) {
  auto X_AB = lookup_kept(a, b, query);
  const auto segments = structure_.forest.segments(a, b);
  if (!X_AB || !segments) return X_AB;
  std::set<Owner> named;
  const Lock lock(structure_.mutex);
  const Lock owners(mutex_);
  // A caller may be here before look_again() is: at a death, or if an owner did not respond.
  drop_kept();
  const auto now = Clock::now();
  for (const Segment& segment : *segments) {
    const auto kept = memories_.find(segment.owner);
    if (segment.owner == kHeldHere || !named.insert(segment.owner).second) continue;
    if (kept == memories_.end()) return fail(Errc::kUnreachable, {});  // another process serves it
    const auto known = owners_.find(segment.owner);
    const bool attached = known != owners_.end() && known->second.state == Known::State::kAttached;
    if (attached && !kept->second.lost) continue;
    X_AB->basis.lost.push_back(
        {structure_.directory.name(segment.owner), now - kept->second.lost.value_or(now)});
  }
  return X_AB;
}

void MemoryReads::wait_for(const std::set<Owner>& owners) {
  MemoryWaits::Owners waited;
  {
    const Lock lock(mutex_);
    for (const Owner owner : owners) {
      const auto found = memories_.find(owner);
      if (found != memories_.end()) {
        waited[owner] = {found->second.forest, found->second.memory};
      }
    }
  }
  waits_.wait_for(std::move(waited));
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
      one.why_not_in_memory =
          is_off_ ? "it is switched off here" : "this client follows only some frames";
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
      auto offered =
          memory_.port->offer(layout_hash(), [this](bool waited) { set_waited(waited); });
      if (!offered) nowhere.why_not = offered.error().message;
      offer_ = offered ? *std::move(offered) : nowhere;
    }
  }
  Reply reply{request.sequence, 0, *offer_};
  std::get<MemoryOffer>(reply.body).incarnation = incarnation;
  return reply;
}

void MemoryReads::set_waited(bool waited) {
  if (!waited) return structure_.forest.on_commit(nullptr, this);
  structure_.forest.on_commit([this] { wake_job_.ask(); }, this);
  // Of what was committed before.
  wake_job_.ask();
}

}  // namespace tfdude
