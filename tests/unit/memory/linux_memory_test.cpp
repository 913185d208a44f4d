#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <functional>
#include <future>
#include <iterator>
#include <string>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "memory/port.hpp"
#include "memory/unix_socket.hpp"
#include "memory/waiting.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/sanitizers.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::outcome;

constexpr std::size_t kSize = std::size_t{1} << 20U;
constexpr std::uint64_t kLayout = 7;
constexpr std::chrono::seconds kLong{10};

struct Offering {
  Offering()
      : memory(port->create(kSize).value()),
        offer(port->offer(kLayout, [this](bool waits) { anyone_waits = waits; }).value()) {}

  std::atomic<bool> anyone_waits{false};
  std::unique_ptr<SharedMemory> port = make_linux_memory();
  OwnMemory memory;
  MemoryOffer offer;
};

void ignore_end(bool) {}

std::string text_at(const MappedMemory& memory) {
  return static_cast<const char*>(memory.at.get());
}

// The status with which a child ends that does this.
int in_child(const std::function<int()>& work) {
  const pid_t child = fork();
  if (child == 0) _exit(work());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE("what an owner writes is read in its memory") {
  Offering owner;
  const auto reader = make_linux_memory();
  const auto seen = reader->attach(owner.offer, kLayout, ignore_end);
  REQUIRE(seen);
  CHECK(seen->size == kSize);
  CHECK(seen->at.get() != owner.memory.at.get());
  CHECK(text_at(*seen).empty());
  std::strcpy(static_cast<char*>(owner.memory.at.get()), "hello");
  CHECK(text_at(*seen) == "hello");
}

TEST_CASE("a reader that waits is woken by what an owner writes, without a message") {
  REQUIRE(can_wait_for_numbers());
  Offering owner;
  const auto reader = make_linux_memory();
  auto seen = reader->attach(owner.offer, kLayout, ignore_end);
  REQUIRE(seen);
  auto& written = *static_cast<std::atomic<std::uint64_t>*>(owner.memory.at.get());
  const auto& read = *static_cast<const std::atomic<std::uint64_t>*>(seen->at.get());
  CHECK_FALSE(owner.anyone_waits);
  seen->tell_waiting(true);
  CHECK(testing::eventually([&] { return owner.anyone_waits.load(); }));
  const auto begin = std::chrono::steady_clock::now();
  // What was written before is not waited for.
  written = 1;
  wait_for_numbers({{&read, 0}}, begin + kLong);
  auto woken = std::async(std::launch::async, [&] {
    while (read == 1) wait_for_numbers({{&read, 1}}, begin + kLong);
  });
  written = 2;
  wake_waiting(written);
  CHECK(woken.wait_until(begin + kLong) == std::future_status::ready);
  CHECK(std::chrono::steady_clock::now() - begin < kLong);
  seen->tell_waiting(false);
  CHECK(testing::eventually([&] { return !owner.anyone_waits; }));
  seen->tell_waiting(true);
  CHECK(testing::eventually([&] { return owner.anyone_waits.load(); }));
  // A reader that is gone waits for nothing.
  seen->at.reset();
  CHECK(testing::eventually([&] { return !owner.anyone_waits; }));
}

TEST_CASE("nobody else can write to it, nor make it shrink") {
  Offering owner;
  const auto reader = make_linux_memory();
  const auto seen = reader->attach(owner.offer, kLayout, ignore_end);
  REQUIRE(seen);
  auto* at = const_cast<void*>(seen->at.get());
  CHECK(mprotect(at, kSize, PROT_READ | PROT_WRITE) != 0);
}

TEST_CASE("who has another token, layout or kernel gets nothing, and is told why") {
  Offering owner;
  const auto reader = make_linux_memory();
  MemoryOffer offer = owner.offer;
  offer.token[0] += 1;
  auto seen = reader->attach(offer, kLayout, ignore_end);
  CHECK(outcome(seen) == "unsupported");
  // Of an impostor, which got the first half of the token.
  offer = owner.offer;
  offer.token[1] += 1;
  seen = reader->attach(offer, kLayout, ignore_end);
  CHECK(outcome(seen) == "unsupported");
  CHECK(seen.error().message == "it does not let this process read");
  seen = reader->attach(owner.offer, kLayout + 1, ignore_end);
  CHECK(seen.error().message == "its memory has another layout: another build");
  offer = owner.offer;
  offer.kernel[0] = 'x';
  seen = reader->attach(offer, kLayout, ignore_end);
  CHECK(seen.error().message == "it runs on another computer");
  offer = owner.offer;
  offer.socket += "x";
  CHECK(outcome(reader->attach(offer, kLayout, ignore_end)) == "unsupported");
  offer = {};
  offer.why_not = "it is switched off there";
  CHECK(reader->attach(offer, kLayout, ignore_end).error().message == offer.why_not);
  CHECK(reader->attach(owner.offer, kLayout, ignore_end));
}

TEST_CASE("an owner that ends says so, and its memory stays readable") {
  auto owner = std::make_unique<Offering>();
  std::strcpy(static_cast<char*>(owner->memory.at.get()), "last");
  const auto reader = make_linux_memory();
  std::promise<bool> ended;
  const auto seen =
      reader->attach(owner->offer, kLayout, [&](bool died) { ended.set_value(died); });
  REQUIRE(seen);
  owner.reset();
  auto end = ended.get_future();
  REQUIRE(end.wait_for(kLong) == std::future_status::ready);
  CHECK_FALSE(end.get());
  CHECK(text_at(*seen) == "last");
}

TEST_CASE("the death of an owner is known at once") {
  int offers[2];  // a pipe
  REQUIRE(pipe(offers) == 0);
  const pid_t child = fork();
  if (child == 0) {
    const Offering owner;
    const std::string text = owner.offer.socket;
    if (write(offers[1], text.data(), text.size()) < 0) _exit(1);
    if (write(offers[1], owner.offer.token.data(), 16) < 0) _exit(1);
    while (true) pause();
  }
  MemoryOffer offer;
  char name[39];
  REQUIRE(read(offers[0], name, sizeof(name)) == sizeof(name));
  REQUIRE(read(offers[0], offer.token.data(), 16) == 16);
  offer.socket.assign(name, sizeof(name));
  offer.layout = kLayout;
  {
    const Offering here;
    offer.kernel = here.offer.kernel;
  }
  const auto reader = make_linux_memory();
  std::promise<std::chrono::steady_clock::time_point> ended;
  const auto seen = reader->attach(offer, kLayout, [&](bool died) {
    if (died) ended.set_value(std::chrono::steady_clock::now());
  });
  REQUIRE(seen);
  auto end = ended.get_future();
  const auto killed = std::chrono::steady_clock::now();
  kill(child, SIGKILL);
  const bool known = end.wait_for(kLong) == std::future_status::ready;
  waitpid(child, nullptr, 0);
  REQUIRE(known);
  // Milliseconds on a computer that is not busy; DDS needs 450 ms.
  CHECK(end.get() - killed < std::chrono::milliseconds(300));
}

TEST_CASE("the end of what is released is not told, and an owner admits others after it") {
  Offering owner;
  const auto reader = make_linux_memory();
  for (int i = 0; i < 2000; ++i) {
    REQUIRE(reader->attach(owner.offer, kLayout, [](bool) { FAIL("told"); }));
  }
}

TEST_CASE("callers that say nothing take few descriptors of an owner, and others come after them") {
  const auto descriptors = [] {
    const std::filesystem::directory_iterator all("/proc/self/fd");
    return std::distance(begin(all), end(all));
  };
  Offering owner;
  const auto before = descriptors();
  constexpr int kSilent = 100;
  std::vector<Descriptor> silent;
  for (int i = 0; i < kSilent; ++i) {
    auto socket = connect_to(owner.offer.socket);
    if (socket) silent.push_back(*std::move(socket));
  }
  REQUIRE(silent.size() > 50);
  const auto own = static_cast<std::ptrdiff_t>(silent.size());
  // The owner hears the first ones, and would have taken all by then.
  REQUIRE(eventually([&] { return descriptors() > before + own + 16; }));
  CHECK(descriptors() <= before + own + 40);
  // Each gets a second.
  const auto reader = make_linux_memory();
  CHECK(eventually([&] { return reader->attach(owner.offer, kLayout, ignore_end).has_value(); }));
}

TEST_CASE("a limit of this process that does not allow it is a reason, and no signal") {
  CHECK(in_child([] {
          const rlimit least{kSize / 2, kSize / 2};
          if (setrlimit(RLIMIT_FSIZE, &least) != 0) return 2;
          const auto memory = make_linux_memory()->create(kSize);
          return outcome(memory) == "unsupported" ? 0 : 1;
        }) == 0);
#ifndef TFDUDE_ADDRESS_SANITIZER  // which reserves more than that
  CHECK(in_child([] {
          const rlimit least{std::size_t{1} << 40U, std::size_t{1} << 40U};
          if (setrlimit(RLIMIT_AS, &least) != 0) return 2;
          const auto memory = make_linux_memory()->create(std::size_t{2} << 40U);
          return outcome(memory) == "unsupported" ? 0 : 1;
        }) == 0);
#endif
}

}  // namespace tfdude
