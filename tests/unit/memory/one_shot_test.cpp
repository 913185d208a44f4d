#include "memory/one_shot.hpp"

#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "memory/one_shot_socket.hpp"
#include "memory/unix_socket.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using Clock = std::chrono::steady_clock;
using testing::Random;

// Of this process only: tests run beside each other.
std::string network() { return "test" + std::to_string(getpid()); }

OneShotAnswer some_answer(Random& random) {
  OneShotAnswer answer;
  static_cast<Transform&>(answer.X_AB) = random.transform();
  answer.X_AB.stamp = time_of(1'700'000'000'000'000'123);
  answer.X_AB.basis.sources = {"a source"};
  answer.X_AB.basis.unspecified = {"odom", "base"};
  answer.path = {{"robot", "world", "base", ClockKind::kExternal}, {"arm", "base", "hand", {}}};
  return answer;
}

bool is_same(const Transform& a, const Transform& b) {
  return a.pose.rotation().coeffs() == b.pose.rotation().coeffs() &&
         a.pose.translation() == b.pose.translation() &&
         a.covariance.of_specified().upper() == b.covariance.of_specified().upper() &&
         a.covariance.complete() == b.covariance.complete();
}

std::string reply_to(const OneShotQuestion& question) {
  OneShotAnswer answer;
  answer.X_AB.basis.unspecified = {question.a, question.b};
  return one_shot_message(answer);
}

std::unique_ptr<OneShotSocket> serve() {
  return OneShotSocket::open(network(), [](std::string_view message) {
    const auto question = one_shot_question(message);
    return question ? reply_to(*question) : std::string();
  });
}

// A busy machine may need longer than is waited for.
bool answers() {
  return testing::eventually([] { return ask_once(network(), {"a", "b"}).has_value(); });
}

Clock::duration time_of_asking(bool& answered) {
  const auto begin = Clock::now();
  answered = ask_once(network(), {"a", "b"}).has_value();
  return Clock::now() - begin;
}

}  // namespace

TEST_CASE("a question and an answer are read as they were written, to the last bit") {
  Random random(21);
  INFO("seed " << random.seed());
  const OneShotQuestion question{"world", "hand left", time_of(-5)};
  const auto asked = one_shot_question(one_shot_message(question));
  REQUIRE(asked);
  CHECK(asked->a == question.a);
  CHECK(asked->b == question.b);
  CHECK(asked->at == question.at);
  CHECK_FALSE(one_shot_question(one_shot_message(OneShotQuestion{"a", "b"}))->at);
  for (int i = 0; i < 100; ++i) {
    const OneShotAnswer answer = some_answer(random);
    const auto read = one_shot_answer(one_shot_message(answer));
    REQUIRE(read);
    CHECK(is_same(read->X_AB, answer.X_AB));
    CHECK(read->X_AB.stamp == answer.X_AB.stamp);
    CHECK(read->X_AB.basis.sources == answer.X_AB.basis.sources);
    CHECK(read->X_AB.basis.unspecified == answer.X_AB.basis.unspecified);
    REQUIRE(read->path.size() == 2);
    CHECK(read->path[0].partition == "robot");
    CHECK(read->path[0].clock == ClockKind::kExternal);
    CHECK(read->path[1].to == "hand");
    CHECK_FALSE(read->path[1].clock);
  }
}

TEST_CASE("what is cut, too long or damaged is no question and no valid answer") {
  Random random(22);
  INFO("seed " << random.seed());
  const std::string question = one_shot_message(OneShotQuestion{"world", "hand"});
  const std::string answer = one_shot_message(some_answer(random));
  for (std::size_t size = 0; size < question.size(); ++size) {
    CHECK_FALSE(one_shot_question(question.substr(0, size)));
  }
  for (std::size_t size = 0; size < answer.size(); ++size) {
    CHECK_FALSE(one_shot_answer(answer.substr(0, size)));
  }
  CHECK_FALSE(one_shot_question(question + "x"));
  CHECK_FALSE(one_shot_answer(answer + "x"));
  CHECK_FALSE(one_shot_answer(question));
  CHECK_FALSE(one_shot_question(answer));
  // Whatever is read is finite, and a rotation; no length of a list is believed.
  for (int i = 0; i < 20'000; ++i) {
    std::string damaged = answer;
    for (std::size_t left = 1 + random.index(4); left > 0; --left) {
      damaged[random.index(damaged.size())] = static_cast<char>(random.index(256));
    }
    const auto read = one_shot_answer(damaged);
    if (!read) continue;
    CHECK(check_finite(read->X_AB));
    CHECK(std::abs(read->X_AB.pose.rotation().norm() - 1) < 1e-6);
    CHECK(read->path.size() <= damaged.size());
  }
  std::string bad_name = one_shot_message(OneShotQuestion{"world", "ha\nd"});
  CHECK_FALSE(one_shot_question(bad_name));
  CHECK_FALSE(one_shot_question(one_shot_message(OneShotQuestion{"world", ""})));
  CHECK_FALSE(one_shot_question(one_shot_message(OneShotQuestion{"w", std::string(256, 'x')})));
}

TEST_CASE("who asks a process of this user is answered, and nobody if it has ended") {
  bool answered = true;
  CHECK(time_of_asking(answered) < std::chrono::seconds(1));
  CHECK_FALSE(answered);
  auto first = serve();
  REQUIRE(first);
  std::optional<OneShotAnswer> found;
  REQUIRE(testing::eventually([&] {
    found = ask_once(network(), {"world", "hand"});
    return found.has_value();
  }));
  CHECK(found->X_AB.basis.unspecified == std::vector<std::string>{"world", "hand"});
  CHECK_FALSE(ask_once(network() + "other", {"world", "hand"}));
  const auto second = serve();
  REQUIRE(second);
  first.reset();
  CHECK(answers());
}

TEST_CASE("if one process does not know the answer, another one is asked") {
  const auto knows_nothing =
      OneShotSocket::open(network(), [](std::string_view) { return std::string(); });
  const auto too_much = OneShotSocket::open(
      network(), [](std::string_view) { return std::string(kMaxOneShotBytes + 1, 'x'); });
  const auto wrong = OneShotSocket::open(
      network(), [](std::string_view) { return std::string(kMaxOneShotBytes, 'x'); });
  REQUIRE((knows_nothing && too_much && wrong));
  CHECK_FALSE(ask_once(network(), {"a", "b"}));
  const auto knows = serve();
  REQUIRE(knows);
  CHECK(answers());
}

TEST_CASE("as many processes of a network as can be asked open sockets, and no more") {
  std::vector<std::unique_ptr<OneShotSocket>> all;
  for (int i = 0; i < kOneShotNames; ++i) REQUIRE(all.emplace_back(serve()));
  CHECK_FALSE(serve());
  all.pop_back();
  CHECK(serve());
}

TEST_CASE("a process that does not answer is waited for no longer than some milliseconds") {
  const auto listening = listen_at(one_shot_name(network(), 0));
  REQUIRE(listening);
  const auto would_answer = serve();
  bool answered = true;
  CHECK(time_of_asking(answered) >= std::chrono::milliseconds(9));
  CHECK_FALSE(answered);
}

TEST_CASE("who connects and is silent, or says nonsense, keeps nobody from being answered") {
  const auto serving = serve();
  REQUIRE(serving);
  std::vector<Descriptor> silent;
  for (int i = 0; i < 8; ++i) {
    auto one = connect_to(one_shot_name(network(), 0));
    REQUIRE(one);
    silent.push_back(*std::move(one));
  }
  const auto nonsense = connect_to(one_shot_name(network(), 0));
  REQUIRE(nonsense);
  CHECK(send_message(*nonsense, std::string(1000, 'x')));
  CHECK(answers());
  // More than are listened to: they are let go.
  for (int i = 0; i < 100; ++i) {
    auto one = connect_to(one_shot_name(network(), 0));
    if (one) silent.push_back(*std::move(one));
  }
  CHECK(answers());
}

TEST_CASE("another user is not answered, nor asked") {
  if (geteuid() != 0) return;  // only root can become another user
  const auto serving = serve();
  REQUIRE(serving);
  const std::string name = one_shot_name(network(), 0);
  const auto as_nobody = [](auto work) {
    const pid_t child = fork();
    if (child == 0) _exit(seteuid(65534) == 0 ? work() : 3);
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  CHECK(as_nobody([] { return ask_once(network(), {"a", "b"}) ? 1 : 0; }) == 0);
  // Under the name of the other one's socket, too.
  CHECK(as_nobody([&] {
          const auto socket = connect_to(name);
          if (!socket) return 2;
          (void)send_message(*socket, one_shot_message(OneShotQuestion{"a", "b"}));
          for (int i = 0; i < 200; ++i) {
            if (!receive_message(*socket, kMaxOneShotBytes).empty()) return 1;
            usleep(1000);
          }
          return is_of_this_user(*socket) ? 4 : 0;
        }) == 0);
}

}  // namespace tfdude
