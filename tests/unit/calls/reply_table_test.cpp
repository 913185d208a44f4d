#include "calls/reply_table.hpp"

#include <memory>
#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude {
namespace {

const ReplyTable::Clock::time_point kOver{};  // long ago: a wait until then only looks

Reply reply_to(const ReplyTable::Entry& entry, std::uint64_t epoch) {
  return {entry.sequence, epoch, Done{}};
}

void answer(ReplyTable& table, const ReplyTable::Entry& entry, std::uint64_t epoch) {
  table.on_reply(entry.partition, reply_to(entry, epoch));
}

std::string error_of(const ReplyTable::Entry& entry) {
  if (!entry.reply) return "waits";
  const auto* error = std::get_if<Error>(&entry.reply->body);
  return error == nullptr ? "ok" : std::string(to_string(error->code)) + ": " + error->message;
}

TEST_CASE("calls: every request has its own number counted from one") {
  ReplyTable table;
  const ReplyTable::Call first(table, {"a", "b"});
  const ReplyTable::Call second(table, {"a"});
  REQUIRE(first.entries().size() == 2);
  CHECK(first.entries()[0].sequence == 1);
  CHECK(first.entries()[1].sequence == 2);
  CHECK(second.entries()[0].sequence == 3);
  CHECK(first.entries()[1].partition == "b");
}

TEST_CASE("calls: a call knows the lowest number whose reply is still expected of a partition") {
  ReplyTable table;
  const auto awaited_of = [&](const std::string& partition) {
    return ReplyTable::Call(table, {partition}).entries()[0].awaits_from;
  };
  auto first = std::make_unique<ReplyTable::Call>(table, std::vector<std::string>{"b", "a"});
  CHECK(first->entries()[0].awaits_from == 1);
  CHECK(first->entries()[1].awaits_from == 2);
  const ReplyTable::Call second(table, {"a"});
  CHECK(second.entries()[0].awaits_from == 2);
  CHECK(awaited_of("b") == 1);
  CHECK(awaited_of("c") == 5);
  answer(table, first->entries()[1], 20);
  CHECK(awaited_of("a") == 3);
  CHECK(awaited_of("a") == 3);
  CHECK(awaited_of("b") == 1);
  first.reset();
  CHECK(awaited_of("b") == 9);
}

TEST_CASE("calls: a call is complete when every partition has replied in any order") {
  ReplyTable table;
  ReplyTable::Call call(table, {"a", "b"});
  CHECK_FALSE(call.wait_until(kOver));
  answer(table, call.entries()[1], 20);
  CHECK_FALSE(call.wait_until(kOver));
  CHECK(call.waits(0));
  CHECK_FALSE(call.waits(1));
  answer(table, call.entries()[0], 10);
  CHECK(call.wait_until(kOver));
  CHECK(call.entries()[0].reply->epoch == 10);
  CHECK(call.entries()[1].reply->epoch == 20);
}

TEST_CASE("calls: a call without partitions is complete at once") {
  ReplyTable table;
  ReplyTable::Call call(table, {});
  CHECK(call.wait_until(kOver));
}

TEST_CASE("calls: repeated and unknown replies are dropped") {
  ReplyTable table;
  ReplyTable::Call call(table, {"a"});
  table.on_reply("a", {0, 99, Done{}});
  table.on_reply("a", {77, 99, Done{}});
  CHECK(call.waits(0));
  answer(table, call.entries()[0], 1);
  answer(table, call.entries()[0], 2);
  CHECK(call.entries()[0].reply->epoch == 1);
}

TEST_CASE("calls: a reply of another partition than the one asked is dropped") {
  ReplyTable table;
  ReplyTable::Call call(table, {"a", "b"});
  table.on_reply("b", reply_to(call.entries()[0], 1));
  table.on_reply("", reply_to(call.entries()[0], 2));
  CHECK(call.waits(0));
  table.on_reply("a", reply_to(call.entries()[0], 3));
  CHECK(call.entries()[0].reply->epoch == 3);
}

TEST_CASE("calls: a reply that comes after its call has ended is dropped") {
  ReplyTable table;
  ReplyTable::Entry over;
  {
    const ReplyTable::Call call(table, {"a"});
    over = call.entries()[0];
  }
  ReplyTable::Call next(table, {"a"});
  answer(table, over, 1);
  table.on_lost("nobody");
  CHECK(next.waits(0));
}

TEST_CASE("calls: a request that is given up gets its error unless the reply has come") {
  ReplyTable table;
  ReplyTable::Call call(table, {"a", "b"});
  answer(table, call.entries()[0], 1);
  call.give_up(0, Error{Errc::kTimeout, "too late"});
  call.give_up(1, Error{Errc::kTimeout, "no answer"});
  CHECK(error_of(call.entries()[0]) == "ok");
  CHECK(error_of(call.entries()[1]) == "timeout: no answer");
  CHECK(call.entries()[1].reply->sequence == call.entries()[1].sequence);
  answer(table, call.entries()[1], 1);
  CHECK(error_of(call.entries()[1]) == "timeout: no answer");
  CHECK(call.wait_until(kOver));
}

TEST_CASE("calls: the loss of a partition fails only the requests that wait for it") {
  ReplyTable table;
  ReplyTable::Call first(table, {"a", "b", "a"});
  ReplyTable::Call second(table, {"b", "c"});
  answer(table, first.entries()[0], 1);
  table.on_lost("a");
  const std::string lost = "unreachable: partition 'a' left before it replied";
  CHECK(error_of(first.entries()[0]) == "ok");
  CHECK(error_of(first.entries()[1]) == "waits");
  CHECK(error_of(first.entries()[2]) == lost);
  CHECK(error_of(second.entries()[0]) == "waits");
  table.on_lost("b");
  CHECK(first.wait_until(kOver));
  CHECK_FALSE(second.wait_until(kOver));
  CHECK(second.waits(1));
}

}  // namespace
}  // namespace tfdude
