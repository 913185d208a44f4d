// Passes any sequence of messages to an owner and its listeners. Each message is valid: requests of
// peers, streams, and claims of other partitions. The owner may also restart. The bytes are
// choices, not messages.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include "fuzz/demand.hpp"
#include "fuzz/forest_checks.hpp"
#include "fuzz/plain_claims.hpp"
#include "fuzz/plain_owner.hpp"
#include "partition/partition.hpp"
#include "partition/requests.hpp"
#include "partition/routing.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

constexpr const char* kOwn = "chest";
constexpr const char* kOthers[] = {"arms", "bench", "legs"};
constexpr std::uint8_t kIds = 8;

// The messages that the bytes choose. They are about few frames, so that they interfere.
class Choices {
 public:
  Choices(const std::uint8_t* data, std::size_t size) : data_(data, size) {}

  [[nodiscard]] bool left() { return data_.remaining_bytes() > 0; }
  template <class T>
  [[nodiscard]] T upto(T largest) {
    return data_.ConsumeIntegralInRange<T>(0, largest);
  }
  [[nodiscard]] std::string id() {
    return std::string(1, static_cast<char>('a' + upto<std::uint8_t>(kIds - 1)));
  }
  [[nodiscard]] std::string parent() { return upto<std::uint8_t>(3) == 0 ? "" : id(); }
  [[nodiscard]] std::string other() { return data_.PickValueInArray(kOthers); }
  [[nodiscard]] Transform transform() {
    const auto x = upto<std::uint8_t>(9);
    return {Pose::trusted(Eigen::Quaterniond::Identity(), {double(x), 0, 0}), {}};
  }

  template <class T, class Make>
  [[nodiscard]] std::vector<T> several(std::uint8_t most, Make make) {
    std::vector<T> all;
    for (auto count = upto(most); count > 0; --count) all.push_back(make());
    return all;
  }
  [[nodiscard]] std::vector<EdgeUpdate> edges() {
    return several<EdgeUpdate>(3, [this] { return EdgeUpdate{id(), transform()}; });
  }
  [[nodiscard]] Request request() {
    Request request{0, id(), {}};
    switch (upto<std::uint8_t>(4)) {
      case 0:
        request.body = AddRequest{parent(), transform(), lamport_time()};
        break;
      case 1:
        request.body =
            RemoveRequest{several<std::string>(3, [this] { return id(); }), lamport_time()};
        break;
      case 2:
        request.body = UpdateRequest{edges()};
        break;
      case 3:
        request.body = MoveRequest{parent(), transform(), lamport_time()};
        break;
      default:
        request.body = LookupRequest{several<PathEnds>(3, [this] { return PathEnds{id(), id()}; })};
    }
    return request;
  }
  [[nodiscard]] std::uint64_t lamport_time() { return upto<std::uint64_t>(20); }
  [[nodiscard]] std::uint64_t incarnation() { return 1 + upto<std::uint64_t>(2); }
  [[nodiscard]] Time time() { return Time(std::chrono::nanoseconds(upto<std::uint64_t>(20))); }
  [[nodiscard]] Tombstone tombstone() {
    const auto kind = static_cast<Tombstone::Kind>(1 + upto<std::uint8_t>(3));
    return {id(), lamport_time(), kind,
            kind == Tombstone::Kind::kRemoved || kind == Tombstone::Kind::kDropped ? "" : other()};
  }
  [[nodiscard]] Page page() {
    Page page{other(), upto<std::uint32_t>(2), incarnation(), upto<std::uint64_t>(9), {}};
    page.entries = several<PageEntry>(5, [this] {
      return PageEntry{id(), parent(), lamport_time()};
    });
    page.tombstones = several<Tombstone>(2, [this] { return tombstone(); });
    return page;
  }
  [[nodiscard]] Presence presence() {
    return {other(), incarnation(),          "tower",
            4711,    upto<std::uint32_t>(3), upto<std::uint8_t>(7) > 0};
  }
  [[nodiscard]] PeerId peer() { return PeerId{upto<std::uint8_t>(1)}; }

 private:
  FuzzedDataProvider data_;
};

// A process that serves a partition, and the model of its frames and of what it has heard.
struct Serving {
  explicit Serving(std::uint64_t life)
      : incarnation(life),
        replica(kOwn),
        partition(kOwn, life, replica.forest, replica.directory) {}

  std::uint64_t incarnation;
  testing::Replica replica;
  Partition partition;
  PlainClaims others{true};
};

class World {
 public:
  World() { start(Time{}, {}); }

  void step(Choices& choices) {
    const Time now = choices.time();
    switch (choices.upto<std::uint8_t>(9)) {
      case 0:
      case 1:
      case 2:
        answer(choices.peer(), choices.request(), now);
        break;
      case 3:
        answer_again(choices);
        break;
      case 4:
      case 5:
      case 6:
        hear(choices.page(), now);
        break;
      case 7:
        hear(choices.presence(), now);
        break;
      case 8:
        if (choices.upto<std::uint8_t>(1) == 0) {
          stream({choices.edges()});
        } else {
          lose(choices.other(), choices.incarnation());
        }
        break;
      default:
        restart(now, choices.upto<std::uint8_t>(1) == 0);
    }
    owner_.demand_told(*all_.life(kOwn));
  }

  void demand_all_is_well() const {
    const testing::Replica& own = own_->replica;
    demand_consistent(own.forest);
    demand_consistent(hearer_.forest);
    demand_shows(own.forest, own.directory, without_cycles(owner_.with(own_->others.oldest())));
    own_->others.demand_counted(own.directory);
    demand_shows(hearer_.forest, hearer_.directory, without_cycles(all_.oldest()));
    all_.demand_counted(hearer_.directory);
    demand_late_joiner();
    demand_stored();
    demand_routes(own);
    demand_routes(hearer_);
  }

 private:
  void answer(const PeerId& peer, Request request, Time now) {
    request.sequence = ++sequence_;
    const std::uint64_t latest = latest_known();
    const Reply reply = own_->partition.answer(peer, request, now);
    demand(reply.sequence == request.sequence, "a reply has its request's number");
    const auto* error = std::get_if<Error>(&reply.body);
    if (error != nullptr) demand_printable(*error);
    if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
      const auto* found = std::get_if<SegmentValues>(&reply.body);
      demand(found == nullptr || found->values.size() == lookup->segments.size(),
             "there is a transform for each segment");
    } else {
      const Picture others = own_->others.oldest();
      demand(owner_.answer(request, others) == (error == nullptr), "what can be done is granted");
      yield(now);
      owner_.yield(others, {});
      if (!is_read_only(request)) answered_.push_back({peer, request, reply});
    }
    owner_.demand_held(own_->replica.forest, latest);
    publish();
  }

  void answer_again(Choices& choices) {
    if (answered_.empty()) return;
    const Answered& once = answered_[choices.upto(answered_.size() - 1)];
    const auto version = own_->replica.forest.structure_version();
    const Reply again = own_->partition.answer(once.peer, once.request, choices.time());
    demand(own_->replica.forest.structure_version() == version,
           "a repeated request changes nothing");
    const bool same =
        again.body.index() == once.reply.body.index() && again.epoch == once.reply.epoch;
    const bool refused = std::holds_alternative<Error>(again.body);
    demand(same || refused, "a repeated request is answered as before, or called too old");
  }

  // Gives up frames that others claim with more right, because the others have reported everything.
  void yield(Time now) {
    while (own_->partition.yield(own_->partition.pending_yields(), now)) {
    }
  }

  template <class Said>
  void hear(const Said& said, Time now) {
    const std::uint64_t latest = latest_known();
    apply(own_->replica, said);
    const auto owner = own_->replica.directory.owner(said.partition);
    if (owner && own_->replica.directory.reachable(*owner)) owner_.hears(said.partition);
    yield(now);
    const std::vector<Tombstone> tombstones = own_->others.apply(said);
    owner_.yield(own_->others.oldest(), tombstones);
    owner_.demand_held(own_->replica.forest, latest);
    apply(hearer_, said);
    (void)all_.apply(said);
    publish();
  }
  static void apply(testing::Replica& replica, const Page& page) { replica.directory.apply(page); }
  static void apply(testing::Replica& replica, const Presence& presence) {
    replica.directory.apply(presence, Time{});
  }

  void publish() {
    demand(store_.save(testing::unsaved(own_->partition)).has_value(), "memory takes all");
    for (const Page& page : own_->partition.take_pages()) {
      hearer_.directory.apply(page);
      (void)all_.apply(page);
    }
    const Presence presence =
        testing::presence_of(kOwn, own_->incarnation, own_->partition.page_count());
    hearer_.directory.apply(presence, Time{});
    (void)all_.apply(presence);
  }

  // The greatest Lamport time that the owner has seen, as far as it still knows it.
  [[nodiscard]] std::uint64_t latest_known() const {
    std::uint64_t latest = own_->others.latest();
    for (const auto& [id, place] : owner_.places()) latest = std::max(latest, place.lamport_time);
    return latest;
  }

  // The owner restarts from its stored state, and hears all others before or after it starts to
  // serve.
  void restart(Time now, bool knowing) {
    const std::vector<Page> said = own_->others.pages();
    start(now, knowing ? said : std::vector<Page>());
    if (knowing) return;
    for (const Page& page : said) hear(page, now);
  }

  void start(Time now, const std::vector<Page>& said) {
    own_ = std::make_unique<Serving>(++lives_);
    owner_.hears_all();
    std::vector<Tombstone> tombstones;
    answered_.clear();
    for (const Page& page : said) {
      own_->replica.directory.apply(page);
      const auto heard = own_->others.apply(page);
      tombstones.insert(tombstones.end(), heard.begin(), heard.end());
    }
    const std::uint64_t latest = latest_known();
    const auto left = store_.load();
    demand(own_->partition.restore(*left, {}, now).has_value(), "what was left is taken");
    owner_.returns(own_->others.oldest());
    owner_.yield(own_->others.oldest(), tombstones);
    owner_.demand_held(own_->replica.forest, latest);
    publish();
  }

  void lose(const std::string& name, std::uint64_t incarnation) {
    for (testing::Replica* replica : {&own_->replica, &hearer_}) {
      const bool there = replica->directory.serving(name).has_value();
      const bool newly_lost = replica->directory.lost(name, incarnation, Time{});
      demand(there || !newly_lost, "nobody is lost who was not there");
      demand(!newly_lost || !replica->directory.serving(name), "who is lost is not there");
      if (newly_lost && replica == &own_->replica) owner_.misses(name);
    }
    own_->others.lose(name, incarnation);
    all_.lose(name, incarnation);
  }

  void stream(const Update& update) {
    std::size_t held = 0;
    for (const EdgeUpdate& edge : update.edges) held += owner_.holds(edge.id) ? 1U : 0U;
    demand(own_->partition.apply(update) == held, "of a stream all is taken that is held");
  }

  // A participant that joins late, and hears the others in reverse order, must get the same result.
  void demand_late_joiner() const {
    testing::Replica late;
    PlainClaims said(false);
    auto pages = all_.pages();
    for (auto page = pages.rbegin(); page != pages.rend(); ++page) {
      late.directory.apply(*page);
      (void)said.apply(*page);
    }
    demand_consistent(late.forest);
    demand_shows(late.forest, late.directory, without_cycles(said.oldest()));
  }

  void demand_stored() const {
    const auto stored = store_.load();
    demand(stored->frames.size() == owner_.places().size(), "what is held is stored");
    for (const StoredFrame& frame : stored->frames) {
      const auto place = owner_.places().find(frame.id);
      demand(place != owner_.places().end() && place->second.parent == frame.parent &&
                 place->second.lamport_time == frame.lamport_time,
             "it is stored as it is held");
    }
  }

  static void demand_routes(const testing::Replica& replica) {
    for (const FrameInfo& frame : replica.forest.frames()) {
      const auto parts = route_remove(replica.forest, replica.directory, frame.id);
      demand(!parts || parts->front().owner == frame.owner, "a frame's owner is asked first");
      for (const FrameInfo& other : replica.forest.frames()) {
        const auto plan = route_lookup(replica.forest, replica.directory, frame.id, other.id);
        if (!plan) demand_printable(plan.error());
        const auto moved = route_move(replica.forest, replica.directory, frame.id, {other.id, {}});
        demand(!moved || moved->owner == frame.owner, "a frame's owner moves it");
      }
    }
  }

  struct Answered {
    PeerId peer{};
    Request request;
    Reply reply;
  };

  mutable testing::MemoryStore store_;  // for load(), which changes nothing
  std::uint64_t lives_ = 0;
  std::unique_ptr<Serving> own_;
  PlainOwner owner_{kOwn};
  testing::Replica hearer_;
  PlainClaims all_{false};
  std::uint32_t sequence_ = 0;
  std::vector<Answered> answered_;
};

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::Choices choices(data, size);
  tfdude::fuzz::World world;
  while (choices.left()) world.step(choices);
  world.demand_all_is_well();
  return 0;
}
