#include "transport/fastdds/creation.hpp"

#include <atomic>
#include <cstdint>
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

void log_not_created(const char* consequence, const Error& error) {
  static std::atomic<std::uint64_t> times{0};
  const std::uint64_t count = ++times;
  if ((count & (count - 1)) == 0) log().error("{}: {}", consequence, error.message);
}

}  // namespace tfdude::fastdds
