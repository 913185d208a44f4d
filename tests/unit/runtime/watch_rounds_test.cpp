// When rounds ask the owners of what is watched. Time comes from the test.

#include "runtime/watch_rounds.hpp"

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;

// One group of one owner, whose plan changes once: at the beginning.
class OneGroup final : public Watched {
 public:
  bool take(const PushedValues& /*pushed*/, Clock::time_point /*now*/) override { return false; }
  void end() override {}
  Result<void> plan(const KnownStructure& /*known*/) override { return {}; }
  Plan adopt(Clock::time_point /*now*/) override {
    return {{{1, {1, "arm", Request{0, "hand", WatchRequest{}}}}}, std::exchange(is_new_, false)};
  }
  bool on_no_plan(Error /*why*/, Clock::time_point /*now*/) override { return true; }
  bool on_deaf(Error /*why*/) override { return true; }
  bool on_denied(const Part& /*part*/, const Error* /*why*/) override { return false; }
  void on_complete() override { ++completed; }
  [[nodiscard]] bool lacks(Clock::time_point /*now*/) const override { return false; }
  [[nodiscard]] std::optional<Time> lacks_from() override { return std::nullopt; }
  [[nodiscard]] std::set<std::uint64_t> groups(Clock::time_point /*now*/) override { return {1}; }
  [[nodiscard]] unsigned periods() const override { return 2; }

  int completed = 0;

 private:
  bool is_new_ = true;
};

// An owner that answers everything while it is there.
class Rounds final : public WatchLink {
 public:
  Rounds() : rounds_(replies_, 1s), watched_(std::make_shared<OneGroup>()) {
    rounds_.add(watched_);
  }

  /// At an instant of the test. @return how often the owner was asked
  int round(Milliseconds at) {
    const auto now = WatchRounds::Clock::time_point() + at;
    int asked = 0;
    rounds_.begin(now);
    while (PendingRequests* requests = rounds_.step(now, *this)) {
      ++asked;
      PushedValues values;
      values.group = 1;
      replies_.on_reply("arm", {requests->parts().front().request.sequence, 0, values});
    }
    return asked;
  }
  int round_after_change(Milliseconds at) {
    REQUIRE(rounds_.look_again());
    return round(at);
  }
  void set_there(bool there) { there_ = there; }
  [[nodiscard]] int completed() const { return watched_->completed; }

 private:
  Result<void> plan(Watched& /*watched*/) override {
    if (there_) return {};
    return fail(Errc::kUnreachable, "silent");
  }
  Result<void> open(const std::string& /*partition*/, std::uint64_t /*group*/) override {
    return {};
  }
  void close(std::uint64_t /*group*/) override {}

  ReplyTable replies_;
  WatchRounds rounds_;
  std::shared_ptr<OneGroup> watched_;
  bool there_ = true;
};

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

TEST_CASE("watch rounds: an owner is asked at the beginning and when it is to be renewed") {
  Rounds rounds;
  CHECK(rounds.round(0ms) == 1);
  CHECK(rounds.round_after_change(100ms) == 0);
  CHECK(rounds.round(1000ms) == 1);
  CHECK(rounds.round(2000ms) == 0);
  CHECK(rounds.round(3000ms) == 1);
}

// The owner may have ended what was not renewed meanwhile, and pushes nothing then.
TEST_CASE("watch rounds: an owner that was silent and is there again is asked at once") {
  Rounds rounds;
  REQUIRE(rounds.round(0ms) == 1);
  rounds.set_there(false);
  CHECK(rounds.round_after_change(100ms) == 0);
  CHECK(rounds.round_after_change(200ms) == 0);
  rounds.set_there(true);
  const int completed = rounds.completed();
  CHECK(rounds.round_after_change(300ms) == 1);
  CHECK(rounds.completed() == completed + 1);
  CHECK(rounds.round_after_change(400ms) == 0);
}

TEST_CASE("watch rounds: what owners deny for long keeps its reader, however much it is") {
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
