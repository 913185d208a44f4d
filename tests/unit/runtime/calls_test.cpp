#include "runtime/calls.hpp"

#include <memory>
#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude {
namespace {

const Calls::Clock::time_point kOver{};  // long ago: a wait until then only looks

Reply reply_to(const Calls::Entry& entry, std::uint64_t epoch) {
  return {entry.sequence, epoch, Done{}};
}

void answer(Calls& calls, const Calls::Entry& entry, std::uint64_t epoch) {
  calls.on_reply(entry.partition, reply_to(entry, epoch));
}

std::string error_of(const Calls::Entry& entry) {
  if (!entry.reply) return "waits";
  const auto* error = std::get_if<Error>(&entry.reply->body);
  return error == nullptr ? "ok" : std::string(to_string(error->code)) + ": " + error->message;
}

TEST_CASE("calls: every request has its own number counted from one") {
  Calls calls;
  const Calls::Call first(calls, {"a", "b"});
  const Calls::Call second(calls, {"a"});
  REQUIRE(first.entries().size() == 2);
  CHECK(first.entries()[0].sequence == 1);
  CHECK(first.entries()[1].sequence == 2);
  CHECK(second.entries()[0].sequence == 3);
  CHECK(first.entries()[1].partition == "b");
}

TEST_CASE("calls: a call knows the lowest number whose reply is still expected") {
  Calls calls;
  auto first = std::make_unique<Calls::Call>(calls, std::vector<std::string>{"a", "b"});
  CHECK(first->awaits_from() == 1);
  const Calls::Call second(calls, {"a"});
  CHECK(second.awaits_from() == 1);
  first.reset();
  CHECK(Calls::Call(calls, {"a"}).awaits_from() == 3);
  CHECK(Calls::Call(calls, {"a"}).awaits_from() == 3);
}

TEST_CASE("calls: a call is complete when every partition has replied in any order") {
  Calls calls;
  Calls::Call call(calls, {"a", "b"});
  CHECK_FALSE(call.wait_until(kOver));
  answer(calls, call.entries()[1], 20);
  CHECK_FALSE(call.wait_until(kOver));
  CHECK(call.waits(0));
  CHECK_FALSE(call.waits(1));
  answer(calls, call.entries()[0], 10);
  CHECK(call.wait_until(kOver));
  CHECK(call.entries()[0].reply->epoch == 10);
  CHECK(call.entries()[1].reply->epoch == 20);
}

TEST_CASE("calls: a call without partitions is complete at once") {
  Calls calls;
  Calls::Call call(calls, {});
  CHECK(call.wait_until(kOver));
}

TEST_CASE("calls: repeated and unknown replies are dropped") {
  Calls calls;
  Calls::Call call(calls, {"a"});
  calls.on_reply("a", {0, 99, Done{}});
  calls.on_reply("a", {77, 99, Done{}});
  CHECK(call.waits(0));
  answer(calls, call.entries()[0], 1);
  answer(calls, call.entries()[0], 2);
  CHECK(call.entries()[0].reply->epoch == 1);
}

TEST_CASE("calls: a reply of another partition than the one asked is dropped") {
  Calls calls;
  Calls::Call call(calls, {"a", "b"});
  calls.on_reply("b", reply_to(call.entries()[0], 1));
  calls.on_reply("", reply_to(call.entries()[0], 2));
  CHECK(call.waits(0));
  calls.on_reply("a", reply_to(call.entries()[0], 3));
  CHECK(call.entries()[0].reply->epoch == 3);
}

TEST_CASE("calls: a reply that comes after its call has ended is dropped") {
  Calls calls;
  Calls::Entry over;
  {
    const Calls::Call call(calls, {"a"});
    over = call.entries()[0];
  }
  Calls::Call next(calls, {"a"});
  answer(calls, over, 1);
  calls.on_lost("nobody");
  CHECK(next.waits(0));
}

TEST_CASE("calls: a request that is given up gets its error unless the reply has come") {
  Calls calls;
  Calls::Call call(calls, {"a", "b"});
  answer(calls, call.entries()[0], 1);
  call.give_up(0, Error{Errc::kTimeout, "too late"});
  call.give_up(1, Error{Errc::kTimeout, "no answer"});
  CHECK(error_of(call.entries()[0]) == "ok");
  CHECK(error_of(call.entries()[1]) == "timeout: no answer");
  CHECK(call.entries()[1].reply->sequence == call.entries()[1].sequence);
  answer(calls, call.entries()[1], 1);
  CHECK(error_of(call.entries()[1]) == "timeout: no answer");
  CHECK(call.wait_until(kOver));
}

TEST_CASE("calls: the loss of a partition fails only the requests that wait for it") {
  Calls calls;
  Calls::Call first(calls, {"a", "b", "a"});
  Calls::Call second(calls, {"b", "c"});
  answer(calls, first.entries()[0], 1);
  calls.on_lost("a");
  const std::string lost = "unreachable: partition 'a' left before it replied";
  CHECK(error_of(first.entries()[0]) == "ok");
  CHECK(error_of(first.entries()[1]) == "waits");
  CHECK(error_of(first.entries()[2]) == lost);
  CHECK(error_of(second.entries()[0]) == "waits");
  calls.on_lost("b");
  CHECK(first.wait_until(kOver));
  CHECK_FALSE(second.wait_until(kOver));
  CHECK(second.waits(1));
}

}  // namespace
}  // namespace tfdude
