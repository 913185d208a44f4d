#include "runtime/commit_loop.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::eventually;
using testing::in_time;

constexpr std::chrono::milliseconds kNever{3600000};

// What any thread did, in order.
class Log {
 public:
  void add(const std::string& line) {
    const std::lock_guard lock(mutex_);
    lines_.push_back(line);
  }
  [[nodiscard]] std::vector<std::string> lines() const {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  [[nodiscard]] bool has(const std::string& line) const {
    const auto all = lines();
    return std::find(all.begin(), all.end(), line) != all.end();
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

// A disk that may be full, or block.
struct Disk {
  std::mutex mutex;
  std::condition_variable changed;
  bool full = false;
  bool reserve_used = false;
  bool stands_still = false;
  std::atomic<int> writes{0};  // begun

  void set(bool Disk::*what, bool value) {
    {
      const std::lock_guard lock(mutex);
      this->*what = value;
    }
    changed.notify_all();
  }
};

class FakeStore final : public StateStore {
 public:
  FakeStore(Disk& disk, Log& log) : disk_(disk), log_(log) {}

  Result<StoredState> load() override { return StoredState{}; }
  Result<void> save(const StateChange& change) override {
    std::string line = "store";
    for (const std::string& id : change.erased) line += " " + id;
    if (!change.values.empty()) line += " " + std::to_string(change.values.size()) + " values";
    return write(line);
  }
  Result<void> make_room() override {
    const std::lock_guard lock(disk_.mutex);
    return disk_.reserve_used ? fail(Errc::kState, "there is no room") : Result<void>();
  }

 private:
  Result<void> write(const std::string& line) {
    std::unique_lock lock(disk_.mutex);
    ++disk_.writes;
    disk_.changed.wait(lock, [this] { return !disk_.stands_still; });
    log_.add(disk_.full ? "fail to " + line : line);
    return disk_.full ? fail(Errc::kState, "the disk is full") : Result<void>();
  }

  Disk& disk_;
  Log& log_;
};

// An owner of changed frames. Each frame has its own page.
class Changer final : public CommitLoop::Effects {
 public:
  explicit Changer(Log& log) : log_(log) {}

  void change(const std::string& id) {
    const std::lock_guard lock(mutex_);
    ids_.push_back(id);
  }
  void change_value() {
    const std::lock_guard lock(mutex_);
    values_.push_back({"hand", {}});
  }
  void give_up() {
    const std::lock_guard lock(mutex_);
    given_up_ = true;
  }

  void owe(const Reply& reply) {
    const std::lock_guard lock(mutex_);
    replies_.push_back({{}, reply, {}});
  }

  Ready take(bool values_due) override {
    const std::lock_guard lock(mutex_);
    Ready ready;
    ready.rows.erased = std::exchange(ids_, {});
    if (values_due) ready.rows.values = std::exchange(values_, {});
    ready.replies = std::exchange(replies_, {});
    if (given_up_) ready.refused = Error{Errc::kNotOwner, "taken over"};
    return ready;
  }
  void publish(const Ready& ready) override {
    for (const std::string& id : ready.rows.erased) log_.add("publish " + id);
  }
  void take_back(const Ready& ready) override {
    const std::lock_guard lock(mutex_);
    ids_.insert(ids_.end(), ready.rows.erased.begin(), ready.rows.erased.end());
    values_.insert(values_.end(), ready.rows.values.begin(), ready.rows.values.end());
  }
  void reply(const PendingReply& pending) override {
    const auto* error = std::get_if<Error>(&pending.reply.body);
    log_.add("reply " + std::to_string(pending.reply.sequence) + ": " +
             (error != nullptr ? error->message : "done"));
  }

 private:
  Log& log_;
  std::mutex mutex_;
  std::vector<std::string> ids_;
  std::vector<ChangedEdge> values_;
  std::vector<PendingReply> replies_;
  bool given_up_ = false;
};

struct Running {
  explicit Running(CommitLoop::Periods periods = {std::chrono::milliseconds(1), kNever, kNever})
      : loop(std::make_unique<FakeStore>(disk, log), changer, periods) {
    REQUIRE(loop.start());
  }
  ~Running() { disk.set(&Disk::stands_still, false); }

  void ask(std::uint32_t sequence) { ask(Reply{sequence, 0, Done{}}); }
  void ask(const Reply& reply) {
    changer.owe(reply);
    loop.hurry();
  }
  void change(const std::string& id, std::uint32_t sequence) {
    changer.change(id);
    ask(sequence);
  }
  [[nodiscard]] std::vector<std::string> done() const { return log.lines(); }
  [[nodiscard]] bool replied(std::uint32_t sequence, const std::string& what) const {
    return log.has("reply " + std::to_string(sequence) + ": " + what);
  }

  Log log;
  Disk disk;
  Changer changer{log};
  CommitLoop loop;
};

const std::string kUnsaved =
    "changed, but not stored; others hear of it once it is stored: the disk is full";

}  // namespace

TEST_CASE("commit loop: stores, then publishes, then replies") {
  Running owner;
  owner.change("hand", 1);
  REQUIRE(eventually([&] { return owner.replied(1, "done"); }));
  CHECK(owner.done() == std::vector<std::string>{"store hand", "publish hand", "reply 1: done"});
}

TEST_CASE("commit loop: changes that come while the disk blocks are stored together") {
  Running owner;
  owner.disk.set(&Disk::stands_still, true);
  owner.change("a", 1);
  REQUIRE(eventually([&] { return owner.disk.writes == 1; }));
  for (std::uint32_t i = 2; i < 12; ++i) owner.change("b", i);
  CHECK(owner.done().empty());
  owner.disk.set(&Disk::stands_still, false);
  REQUIRE(eventually([&] { return owner.replied(11, "done"); }));
  REQUIRE(owner.loop.flush(in_time()));
  const auto lines = owner.done();
  const auto stored = std::count_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.rfind("store", 0) == 0;
  });
  CHECK(stored == 2);
}

TEST_CASE("commit loop: changes that could not be stored are neither published nor confirmed") {
  Running owner;
  owner.disk.set(&Disk::full, true);
  owner.change("hand", 1);
  REQUIRE(eventually([&] { return owner.replied(1, kUnsaved); }));
  REQUIRE(owner.loop.failure());
  CHECK(owner.loop.failure()->code == Errc::kState);
  CHECK_FALSE(owner.log.has("publish hand"));
  const auto flushed = owner.loop.flush(in_time());
  REQUIRE_FALSE(flushed);
  CHECK(flushed.error().code == Errc::kState);
  CHECK_THAT(flushed.error().message, ContainsSubstring("the disk is full"));

  // A rejection may depend on a change that is not stored, so it is not sent either.
  owner.ask(Reply{2, 0, Error{Errc::kAlreadyExists, "it exists"}});
  REQUIRE(eventually([&] { return owner.replied(2, "the disk is full"); }));

  owner.disk.set(&Disk::full, false);
  owner.ask(3);
  REQUIRE(eventually([&] { return owner.replied(3, "done"); }));
  CHECK(owner.log.has("publish hand"));
  CHECK(eventually([&] { return !owner.loop.failure(); }));
}

TEST_CASE("commit loop: after a change that leaves no room for another, none is accepted") {
  Running owner({std::chrono::milliseconds(1), kNever, std::chrono::milliseconds(5)});
  owner.disk.set(&Disk::reserve_used, true);
  owner.change("hand", 1);
  REQUIRE(eventually([&] { return owner.replied(1, "done"); }));
  CHECK(owner.log.has("publish hand"));
  REQUIRE(owner.loop.failure());
  CHECK(owner.loop.failure()->message == "there is no room");
  CHECK(owner.loop.flush(in_time()));

  owner.disk.set(&Disk::reserve_used, false);
  CHECK(eventually([&] { return !owner.loop.failure(); }));
}

TEST_CASE("commit loop: changes that could not be stored are retried without a request") {
  Running owner({std::chrono::milliseconds(1), kNever, std::chrono::milliseconds(5)});
  owner.disk.set(&Disk::full, true);
  SECTION("changes") {
    owner.changer.change("hand");
    owner.loop.ask();
  }
  SECTION("values") {
    owner.changer.change_value();
    owner.changer.change("hand");
    owner.loop.ask();
  }
  REQUIRE(eventually([&] { return owner.loop.failure().has_value(); }));
  CHECK_FALSE(owner.log.has("publish hand"));
  owner.disk.set(&Disk::full, false);
  CHECK(eventually([&] { return !owner.loop.failure(); }));
  CHECK(owner.log.has("publish hand"));
}

TEST_CASE("commit loop: values are stored periodically and at the end") {
  Log log;
  Disk disk;
  Changer changer(log);
  {
    const auto period = GENERATE(std::chrono::milliseconds(2), kNever);
    CommitLoop loop(std::make_unique<FakeStore>(disk, log), changer,
                    {std::chrono::milliseconds(1), period, kNever});
    REQUIRE(loop.start());
    changer.change_value();
    if (period != kNever) REQUIRE(eventually([&] { return log.has("store 1 values"); }));
  }
  CHECK(log.has("store 1 values"));
}

TEST_CASE("commit loop: a flush times out while the disk blocks") {
  Running owner;
  owner.disk.set(&Disk::stands_still, true);
  owner.changer.change("hand");
  const auto flushed = owner.loop.flush(CommitLoop::Clock::now() + std::chrono::milliseconds(5));
  REQUIRE_FALSE(flushed);
  CHECK(flushed.error().code == Errc::kTimeout);
}

TEST_CASE("commit loop: an owner that lost its partition stores nothing and says so") {
  Running owner;
  owner.changer.give_up();
  owner.change("hand", 1);
  REQUIRE(eventually([&] { return owner.replied(1, "taken over"); }));
  CHECK_FALSE(owner.log.has("store hand"));
  CHECK_FALSE(owner.loop.failure());
}

TEST_CASE("commit loop: without a store it publishes and replies") {
  Log log;
  Changer changer(log);
  CommitLoop loop(nullptr, changer, {});
  REQUIRE(loop.start());
  changer.change("hand");
  CHECK(loop.flush(in_time()));
  CHECK(log.lines() == std::vector<std::string>{"publish hand"});
}

}  // namespace tfdude
