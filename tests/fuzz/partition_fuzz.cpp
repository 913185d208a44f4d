// What an owner and its hearers make of any sequence of messages, all of them valid one by one: requests of
// peers, streams, and what other partitions say that they own. The bytes are choices, not messages.

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include "tfdude/partition/partition.hpp"
#include "tfdude/partition/routing.hpp"

#include "fuzz/demand.hpp"
#include "fuzz/forest_checks.hpp"
#include "fuzz/plain_claims.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

constexpr const char* kOwn = "chest";
constexpr const char* kOthers[] = {"arms", "bench", "legs"};
constexpr std::uint8_t kIds = 8;

// The messages that the bytes choose, about few frames, so that they meet.
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
    Request request{upto<std::uint32_t>(600), id(), {}};
    switch (upto<std::uint8_t>(4)) {
      case 0:
        request.body = AddRequest{parent(), transform()};
        break;
      case 1:
        request.body = RemoveRequest{several<std::string>(3, [this] { return id(); })};
        break;
      case 2:
        request.body = UpdateRequest{edges()};
        break;
      case 3:
        request.body = MoveRequest{parent(), transform()};
        break;
      default:
        request.body = LookupRequest{several<PathEnds>(3, [this] { return PathEnds{id(), id()}; })};
    }
    return request;
  }
  [[nodiscard]] Page page() {
    Page page{other(), upto<std::uint32_t>(2), upto<std::uint64_t>(3), upto<std::uint64_t>(9), {}};
    page.entries = several<PageEntry>(5, [this] { return PageEntry{id(), parent()}; });
    return page;
  }
  [[nodiscard]] Presence presence() {
    return {other(), upto<std::uint64_t>(3), "tower",
            4711,    upto<std::uint32_t>(3), upto<std::uint8_t>(7) > 0};
  }
  [[nodiscard]] PeerId peer() { return PeerId{upto<std::uint8_t>(1)}; }

 private:
  FuzzedDataProvider data_;
};

class World {
 public:
  void step(Choices& choices) {
    switch (choices.upto<std::uint8_t>(6)) {
      case 0:
      case 1:
        answer(choices.peer(), choices.request());
        break;
      case 2:
      case 3:
        hear(choices.page());
        break;
      case 4:
        hear(choices.presence());
        break;
      case 5:
        lose(choices.other(), choices.upto<std::uint64_t>(3));
        break;
      default:
        stream({choices.edges()});
    }
  }

  void demand_all_is_well() const {
    demand_consistent(own_.forest);
    demand_consistent(hearer_.forest);
    others_claims_.demand_followed(own_.forest, own_.directory);
    others_claims_.demand_counted(own_.directory);
    all_claims_.demand_followed(hearer_.forest, hearer_.directory);
    all_claims_.demand_counted(hearer_.directory);
    testing::Replica late;
    late.apply(all_claims_.pages());
    demand_consistent(late.forest);
    all_claims_.demand_followed(late.forest, late.directory);
    demand_published();
    demand_routes(own_);
    demand_routes(hearer_);
  }

 private:
  void answer(const PeerId& peer, const Request& request) {
    const Reply reply = partition_.answer(peer, request);
    demand(reply.sequence == request.sequence, "a reply has its request's number");
    if (const auto* error = std::get_if<Error>(&reply.body)) demand_printable(*error);
    if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
      const auto* transforms = std::get_if<std::vector<Transform>>(&reply.body);
      demand(transforms == nullptr || transforms->size() == lookup->segments.size(),
             "there is a transform for each segment");
    }
    publish();
    const auto version = own_.forest.structure_version();
    const Reply again = partition_.answer(peer, request);
    demand(again.body.index() == reply.body.index() && again.epoch == reply.epoch,
           "a repeated request is answered as before");
    demand(own_.forest.structure_version() == version, "a repeated request changes nothing");
  }

  void publish() {
    for (const Page& page : partition_.take_pages()) {
      hearer_.directory.apply(page);
      all_claims_.apply(page);
    }
  }

  template <class Said>
  void hear(const Said& said) {
    apply(own_, said);
    apply(hearer_, said);
    others_claims_.apply(said);
    all_claims_.apply(said);
  }
  static void apply(testing::Replica& replica, const Page& page) { replica.directory.apply(page); }
  static void apply(testing::Replica& replica, const Presence& presence) {
    replica.directory.apply(presence, Time{});
  }

  void lose(const std::string& name, std::uint64_t incarnation) {
    for (testing::Replica* replica : {&own_, &hearer_}) {
      const bool there = replica->directory.serving(name).has_value();
      const bool news = replica->directory.lost(name, incarnation, Time{});
      demand(there || !news, "nobody is lost who was not there");
      demand(!news || !replica->directory.serving(name), "who is lost is not there");
    }
  }

  void stream(const Update& update) {
    std::size_t held = 0;
    for (const EdgeUpdate& edge : update.edges) held += own_.forest.holds(edge.id) ? 1U : 0U;
    demand(partition_.apply(update) == held, "of a stream all is taken that is held");
  }

  void demand_published() const {
    std::size_t held = 0;
    for (const FrameInfo& frame : own_.forest.frames()) {
      if (frame.owner != kHeldHere) continue;
      ++held;
      demand(all_claims_.parents(kOwn, frame.id) == std::set<std::string>{frame.parent},
             "what is held is published as it is");
    }
    demand(partition_.frame_count() == held, "nothing is published but what is held");
  }

  static void demand_routes(const testing::Replica& replica) {
    for (const FrameInfo& frame : replica.forest.frames()) {
      const auto parts = route_remove(replica.forest, replica.directory, frame.id);
      demand(!parts || parts->front().owner == frame.owner, "a frame's owner is asked first");
      for (const FrameInfo& other : replica.forest.frames()) {
        const auto plan = route_lookup(replica.forest, replica.directory, frame.id, other.id);
        if (!plan) demand_printable(plan.error());
        const auto moved =
            route_move(replica.forest, replica.directory, frame.id, {other.id, std::nullopt});
        demand(!moved || moved->owner == frame.owner, "a frame's owner moves it");
      }
    }
  }

  testing::Replica own_{kOwn};
  Partition partition_{kOwn, 1, own_.forest, own_.directory};
  testing::Replica hearer_;
  PlainClaims others_claims_;
  PlainClaims all_claims_;
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
