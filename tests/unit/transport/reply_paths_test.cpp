#include "transport/fastdds/reply_paths.hpp"

#include <chrono>
#include <thread>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

ertps::GUID_t writer(std::uint8_t number) {
  ertps::GUID_t guid;
  guid.guidPrefix.value[0] = number;
  return guid;
}

ReplyPaths::Deadline in(std::chrono::milliseconds time) {
  return std::chrono::steady_clock::now() + time;
}

}  // namespace

TEST_CASE("reply paths: of an owner while one of its writers is matched") {
  ReplyPaths paths;
  CHECK_FALSE(paths.wait_until("arm", in({})));
  paths.opened(writer(1), "arm");
  CHECK(paths.wait_until("arm", in({})));
  CHECK_FALSE(paths.wait_until("base", in({})));
  paths.opened(writer(2), "arm");  // it has restarted
  paths.closed(writer(1));
  CHECK(paths.wait_until("arm", in({})));
  paths.closed(writer(2));
  CHECK_FALSE(paths.wait_until("arm", in({})));
}

TEST_CASE("reply paths: who waits is woken") {
  ReplyPaths paths;
  std::thread matching([&] { paths.opened(writer(1), "arm"); });
  CHECK(paths.wait_until("arm", in(std::chrono::seconds(20))));
  matching.join();
}

}  // namespace tfdude::fastdds
