#include "transport/fastdds/creation.hpp"

#include <atomic>
#include <cstdint>
#include <utility>

#include "base/log.hpp"
#include "base/mutex.hpp"

namespace tfdude::fastdds {
namespace {

struct Failing {
  Mutex mutex;
  FailCreation fails TFDUDE_GUARDED_BY(mutex);
};

Failing& failing() {
  static Failing failing;
  return failing;
}

}  // namespace

void fail_creations(FailCreation fails) {
  const Lock lock(failing().mutex);
  failing().fails = std::move(fails);
}

bool creation_fails(const std::string& what) {
  FailCreation fails;
  {
    const Lock lock(failing().mutex);
    fails = failing().fails;
  }
  return fails && fails(what);
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
