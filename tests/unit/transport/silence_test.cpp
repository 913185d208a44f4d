#include "transport/silence.hpp"

#include <chrono>

#include "support/catch.hpp"

namespace tfdude {
namespace {

using Kind = Silence::Kind;
using std::chrono::milliseconds;

constexpr Patience kPatience{milliseconds(450), milliseconds(2000), milliseconds(5000),
                             milliseconds(200)};
constexpr Hearing::Time kStart{std::chrono::hours(1)};

Hearing heard(bool replied) {
  Hearing hearing;
  hearing.last = kStart;
  hearing.present = true;
  hearing.replied = replied;
  return hearing;
}

Kind kind_after(const Hearing& hearing, milliseconds time) {
  return judge(hearing, kPatience, kStart + time).kind;
}

}  // namespace

TEST_CASE("silence: a participant that needs a server probes it and counts it as lost soon") {
  Hearing hearing = heard(true);
  hearing.need(true, kStart);
  CHECK(kind_after(hearing, milliseconds(99)) == Kind::kNone);
  CHECK(kind_after(hearing, milliseconds(100)) == Kind::kAsk);
  CHECK(kind_after(hearing, milliseconds(449)) == Kind::kAsk);
  CHECK(kind_after(hearing, milliseconds(450)) == Kind::kLost);
}

TEST_CASE("silence: a participant that needs no server probes nobody and waits longer") {
  const Hearing hearing = heard(true);
  CHECK(kind_after(hearing, milliseconds(1999)) == Kind::kNone);
  CHECK(kind_after(hearing, milliseconds(2000)) == Kind::kLost);
}

TEST_CASE("silence: a server that has not replied yet gets more time") {
  Hearing hearing = heard(false);
  hearing.need(true, kStart);
  CHECK(kind_after(hearing, milliseconds(1999)) == Kind::kAsk);
  CHECK(kind_after(hearing, milliseconds(2000)) == Kind::kLost);
}

TEST_CASE("silence: a server that is only streamed to is asked although it acknowledges") {
  Hearing hearing = heard(false);
  hearing.need(true, kStart);
  const auto acknowledged_at = [&](milliseconds time) {
    hearing.last = kStart + time;
    return kind_after(hearing, time);
  };
  CHECK(acknowledged_at(milliseconds(99)) == Kind::kNone);
  CHECK(acknowledged_at(milliseconds(100)) == Kind::kAsk);
  hearing.asked = kStart + milliseconds(100);
  CHECK(acknowledged_at(milliseconds(199)) == Kind::kNone);
  CHECK(acknowledged_at(milliseconds(200)) == Kind::kAsk);
  hearing.replied = true;
  CHECK(acknowledged_at(milliseconds(300)) == Kind::kNone);
  CHECK(kind_after(hearing, milliseconds(749)) == Kind::kAsk);
  CHECK(kind_after(hearing, milliseconds(750)) == Kind::kLost);
}

TEST_CASE("silence: who begins to need a server does not begin to wait for it anew") {
  Hearing hearing = heard(false);
  hearing.need(true, kStart + milliseconds(1900));
  CHECK(kind_after(hearing, milliseconds(1999)) == Kind::kNone);
  CHECK(kind_after(hearing, milliseconds(2000)) == Kind::kLost);
  hearing.replied = true;
  CHECK(kind_after(hearing, milliseconds(2000)) == Kind::kLost);
}

TEST_CASE("silence: a server without a presence gets more time") {
  Hearing hearing = heard(false);
  hearing.present = false;
  CHECK(kind_after(hearing, milliseconds(4999)) == Kind::kNone);
  CHECK(kind_after(hearing, milliseconds(5000)) == Kind::kLost);
}

TEST_CASE("silence: it begins when the server is needed because nobody probed it before") {
  Hearing hearing = heard(true);
  hearing.need(true, kStart + milliseconds(1000));
  hearing.need(true, kStart + milliseconds(1200));  // still
  CHECK(kind_after(hearing, milliseconds(1099)) == Kind::kNone);
  CHECK(kind_after(hearing, milliseconds(1449)) == Kind::kAsk);
  CHECK(kind_after(hearing, milliseconds(1450)) == Kind::kLost);
  hearing.need(false, kStart + milliseconds(1450));
  CHECK(kind_after(hearing, milliseconds(1450)) == Kind::kNone);
}

TEST_CASE("silence: a loss is early if participants that need no server notice it later") {
  Hearing hearing = heard(true);
  hearing.need(true, kStart);
  CHECK(judge(hearing, kPatience, kStart + milliseconds(450)).early == milliseconds(1750));
  hearing.need(false, kStart);
  CHECK(judge(hearing, kPatience, kStart + milliseconds(2100)).early == milliseconds(100));
  CHECK(judge(hearing, kPatience, kStart + milliseconds(3000)).early == milliseconds(0));
}

TEST_CASE("silence: a participant that looks late starts again") {
  Hearing hearing = heard(true);
  hearing.need(true, kStart);
  hearing.pass_over(milliseconds(300));
  CHECK(kind_after(hearing, milliseconds(749)) == Kind::kAsk);
  CHECK(kind_after(hearing, milliseconds(750)) == Kind::kLost);
}

}  // namespace tfdude
