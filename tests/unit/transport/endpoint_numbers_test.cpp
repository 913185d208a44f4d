// Which endpoints of a participant are announced again, so that new participants discover them
// fast.

#include "transport/fastdds/endpoint_numbers.hpp"

#include <chrono>
#include <future>
#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;

struct Endpoints {
  EndpointNumbers::Id create(const std::string& name) {
    return numbers.created([this, name] { announced.push_back(name); });
  }
  void create_and_delete(std::uint64_t times) {
    for (std::uint64_t i = 0; i < times; ++i) numbers.deleted(create("short-lived"));
  }

  EndpointNumbers numbers;
  std::vector<std::string> announced;
};

}  // namespace

TEST_CASE("endpoint numbers: without deletions nothing is announced again") {
  Endpoints endpoints;
  for (int i = 0; i < 1000; ++i) (void)endpoints.create("lasting");
  CHECK(endpoints.numbers.unused() == 0);
  endpoints.numbers.tidy();
  CHECK(endpoints.announced.empty());
}

TEST_CASE("endpoint numbers: the oldest endpoints are announced again") {
  Endpoints endpoints;
  (void)endpoints.create("first");
  (void)endpoints.create("second");
  endpoints.create_and_delete(EndpointNumbers::kMostUnused);
  // Unused numbers after the newest endpoint do not matter.
  endpoints.numbers.tidy();
  CHECK(endpoints.announced.empty());
  (void)endpoints.create("last");
  CHECK(endpoints.numbers.unused() == 2 * EndpointNumbers::kMostUnused);
  endpoints.numbers.tidy();
  CHECK(endpoints.announced == std::vector<std::string>{"first", "second"});
  CHECK(endpoints.numbers.unused() == 0);
}

TEST_CASE("endpoint numbers: no more are announced again than needed") {
  Endpoints endpoints;
  (void)endpoints.create("first");
  endpoints.create_and_delete(EndpointNumbers::kMostUnused / 2);
  (void)endpoints.create("second");
  endpoints.create_and_delete(EndpointNumbers::kMostUnused / 2);
  (void)endpoints.create("third");
  endpoints.numbers.tidy();
  CHECK(endpoints.announced == std::vector<std::string>{"first"});
  CHECK(endpoints.numbers.unused() == EndpointNumbers::kMostUnused);
}

TEST_CASE("endpoint numbers: an endpoint is not deleted while it is announced again") {
  EndpointNumbers numbers;
  std::promise<void> inside;
  std::promise<void> go_on;
  const auto first = numbers.created([&] {
    inside.set_value();
    go_on.get_future().wait();
  });
  for (std::uint64_t i = 0; i < EndpointNumbers::kMostUnused; ++i)
    numbers.deleted(numbers.created([] {}));
  const auto last = numbers.created([] {});
  const auto tidied = std::async(std::launch::async, [&] { numbers.tidy(); });
  inside.get_future().wait();
  numbers.deleted(last);  // another one is
  const auto deleted = std::async(std::launch::async, [&] { numbers.deleted(first); });
  CHECK(deleted.wait_for(20ms) == std::future_status::timeout);
  go_on.set_value();
  deleted.wait();
  tidied.wait();
  CHECK(numbers.unused() == 0);
}

TEST_CASE("endpoint numbers: the deletion of one that was never created does not wait") {
  EndpointNumbers numbers;
  numbers.deleted(EndpointNumbers::kNone);
  const auto first = numbers.created([] {});
  numbers.deleted(EndpointNumbers::kNone);
  numbers.deleted(first);
  CHECK(numbers.unused() == 0);
}

}  // namespace tfdude::fastdds
