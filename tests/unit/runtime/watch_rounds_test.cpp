#include "runtime/watch_rounds.hpp"

#include <map>
#include <string>

#include "support/catch.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;

/// Something of one group, whose owner denies it.
class Denied final : public Watched {
 public:
  explicit Denied(std::uint64_t group) : group_(group) {}

  bool take(const PushedValues& /*pushed*/, Clock::time_point /*now*/) override { return false; }
  void end() override {}
  Result<void> plan(const KnownStructure& /*known*/) override { return {}; }
  Plan adopt(Clock::time_point /*now*/) override {
    return {{{group_, {Owner{1}, "arm", Request{1, "arm", WatchRequest{}}}}}, true};
  }
  bool on_no_plan(Error /*why*/, Clock::time_point /*now*/) override { return false; }
  bool on_deaf(Error /*why*/) override { return false; }
  bool on_denied(const Part& /*part*/, const Error* /*why*/) override {
    ++denied;
    return false;
  }
  bool lacks(Clock::time_point /*now*/) const override { return true; }
  std::optional<Time> lacks_from() override { return {}; }
  std::set<std::uint64_t> groups(Clock::time_point /*now*/) override { return {}; }
  unsigned periods() const override { return 1; }

  int denied = 0;

 private:
  const std::uint64_t group_;
};

/// Denies each request, and counts the readers.
class Denying final : public WatchLink, public RequestLink {
 public:
  Result<void> plan(Watched& /*watched*/) override { return {}; }
  Result<void> open(const std::string& /*partition*/, std::uint64_t group) override {
    ++opened[group];
    return {};
  }
  void close(std::uint64_t /*group*/) override { ++closed; }

  Result<void> send(const std::string& partition, const Request& request,
                    TimeLimit::Clock::time_point /*until*/) override {
    replies.on_reply(partition, {request.sequence, 0, Error{Errc::kNotOwner, "not below that"}});
    return {};
  }
  Reply answer(const Request& request) override { return {request.sequence, 0, Done{}}; }

  ReplyTable replies;
  std::map<std::uint64_t, int> opened;
  int closed = 0;
};

}  // namespace

TEST_CASE("rounds: what owners deny for long keeps its reader, however much it is") {
  constexpr std::uint64_t kWatches = 2 * OpenGroups::kMostUnused;
  constexpr int kRounds = 300;
  Denying link;
  WatchRounds rounds(link.replies, 500ms);
  std::vector<std::shared_ptr<Denied>> watches;
  for (std::uint64_t group = 1; group <= kWatches; ++group) {
    watches.push_back(std::make_shared<Denied>(group));
    rounds.add(watches.back());
  }
  WatchRounds::Clock::time_point now{1h};
  for (int round = 0; round < kRounds; ++round, now += 50ms) {
    rounds.begin(now);
    while (PendingRequests* asked = rounds.step(now, link)) {
      (void)asked->step(now, link);
      REQUIRE(asked->complete());
    }
  }
  CHECK(watches.back()->denied == kRounds);
  CHECK(link.closed == 0);
  CHECK(link.opened.size() == kWatches);
  for (const auto& [group, times] : link.opened) CHECK(times == 1);

  watches.clear();
  rounds.begin(now += 1s);
  CHECK(rounds.step(now, link) == nullptr);
  CHECK(link.closed == static_cast<int>(kWatches - OpenGroups::kMostUnused));
  rounds.begin(now += OpenGroups::kKept);
  CHECK(rounds.step(now, link) == nullptr);
  CHECK(link.closed == static_cast<int>(kWatches));
}

}  // namespace tfdude
