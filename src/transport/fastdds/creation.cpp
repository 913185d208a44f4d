#include "transport/fastdds/creation.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <future>
#include <pthread.h>
#include <utility>

#include "base/log.hpp"
#include "base/mutex.hpp"

namespace tfdude::fastdds {
namespace {

class Failing {
 public:
  void set(FailCreation fails) {
    const Lock lock(mutex_);
    fails_ = std::move(fails);
  }
  [[nodiscard]] FailCreation get() {
    const Lock lock(mutex_);
    return fails_;
  }

 private:
  Mutex mutex_;
  FailCreation fails_ TFDUDE_GUARDED_BY(mutex_);
};

Failing& failing() {
  static Failing failing;
  return failing;
}

}  // namespace

void fail_creations(FailCreation fails) { failing().set(std::move(fails)); }

bool creation_fails(const std::string& what) {
  const FailCreation fails = failing().get();
  return fails && fails(what);
}

Mutex& endpoints_change() {
  static Mutex mutex{LockRank::kEndpoints};
  return mutex;
}

tl::unexpected<Error> not_created(const std::string& what) {
  return fail(Errc::kTransport, "Fast DDS could not create " + what);
}

Result<void> threads_to_spare() {
  // One for each socket on which it receives, and some others.
  std::array<pthread_t, 12> threads{};
  std::promise<void> all;
  const std::shared_future<void> ended = all.get_future().share();
  const auto wait = [](void* until) -> void* {
    static_cast<const std::shared_future<void>*>(until)->wait();
    return nullptr;
  };
  std::size_t begun = 0;
  int error = 0;
  while (begun < threads.size() && error == 0) {
    error = pthread_create(&threads[begun], nullptr, wait,
                           const_cast<void*>(static_cast<const void*>(&ended)));
    if (error == 0) ++begun;
  }
  all.set_value();
  for (std::size_t i = 0; i < begun; ++i) pthread_join(threads[i], nullptr);
  if (error == 0) return {};
  return fail(Errc::kTransport, "no threads for Fast DDS: " + std::string(std::strerror(error)));
}

void log_not_created(const char* consequence, const Error& error) {
  static std::atomic<std::uint64_t> times{0};
  if (is_logged(++times)) log().error("{}: {}", consequence, error.message);
}

}  // namespace tfdude::fastdds
