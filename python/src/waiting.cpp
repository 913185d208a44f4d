#include "waiting.hpp"

#include <future>
#include <stdexcept>

namespace tfdude::python {

namespace {

thread_local const std::atomic<bool>* call_ended = nullptr;

}  // namespace

void check_interrupted() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  check_usable();
  if (call_ended != nullptr && *call_ended) throw std::runtime_error("the call was cancelled");
}

py::object EndableCall::run(const py::function& call) const {
  struct Within {
    explicit Within(const std::atomic<bool>& ended) { call_ended = &ended; }
    ~Within() { call_ended = nullptr; }
  };
  const Within within(ended_);
  return call();
}

// As the library's own, of which only installed headers are seen here.
bool may_return(Errc code) {
  return is_unknown(code) || code == Errc::kNotConnected || code == Errc::kUnreachable ||
         code == Errc::kTimeout || code == Errc::kNotOwner || code == Errc::kNotYet;
}

bool is_worth_waiting(Errc code, const Query& query) {
  // What was believed then stays as it is.
  if (query.believed_at && (code == Errc::kTooOld || code == Errc::kNotYet)) return false;
  // For the latest common time: one edge is ahead of the data of another.
  if (code == Errc::kTooOld) return !query.at;
  return may_return(code);
}

Error of_whole_wait(Error error, Milliseconds slice, Milliseconds wait) {
  const auto within = [](Milliseconds time) {
    return " within " + std::to_string(std::max(time, Milliseconds(0)).count()) + " ms";
  };
  const std::string of_slice = within(slice);
  const std::size_t at = error.message.find(of_slice);
  if (at != std::string::npos) error.message.replace(at, of_slice.size(), within(wait));
  return error;
}

Result<StampedTransform> wait_for_lookup(const Session& session, const std::string& a,
                                         const std::string& b, const Query& query,
                                         Milliseconds wait) {
  using Answer = Result<StampedTransform>;
  const auto answer = std::make_shared<std::promise<Answer>>();
  std::future<Answer> ready = answer->get_future();
  Ending<PendingLookup> pending(session.call([&](Client& client) {
    return client.lookup_async(a, b, query, wait,
                               [answer](Answer X) { answer->set_value(std::move(X)); });
  }));
  const auto is_ready = [&] { return ready.wait_for(kLook) == std::future_status::ready; };
  while (!without_gil(is_ready)) {
    check_interrupted();
    if (session.closed()) return tl::unexpected(closed_error());
  }
  return ready.get();
}

}  // namespace tfdude::python
