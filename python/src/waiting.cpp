#include "waiting.hpp"

#include <future>

namespace tfdude::python {
namespace {

/// How often a wait looks for signals.
constexpr Milliseconds kLook{50};

}  // namespace

Result<StampedTransform> wait_for_lookup(const Session& session, const std::string& a,
                                         const std::string& b, const Query& query,
                                         Milliseconds wait) {
  const auto answer = std::make_shared<std::promise<Result<StampedTransform>>>();
  std::future<Result<StampedTransform>> ready = answer->get_future();
  PendingLookup pending = session.call([&](Client& client) {
    return client.lookup_async(a, b, query, wait, [answer](Result<StampedTransform> X) {
      answer->set_value(std::move(X));
    });
  });
  while (true) {
    const bool is_ready =
        without_gil([&] { return ready.wait_for(kLook) == std::future_status::ready; });
    if (is_ready) break;
    const bool interrupted = PyErr_CheckSignals() != 0;
    if (!interrupted && !exiting() && !session.closed()) continue;
    without_gil([&] {
      pending.cancel();
      return 0;
    });
    if (interrupted) throw py::error_already_set();
    check_usable();
    raise({Errc::kTimeout, "the client was closed"});
  }
  auto X = ready.get();
  without_gil([&] {
    pending.cancel();
    return 0;
  });
  return X;
}

}  // namespace tfdude::python
