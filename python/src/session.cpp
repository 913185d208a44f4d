#include "session.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <pthread.h>
#include <set>

namespace tfdude::python {
namespace {

struct Process {
  std::mutex mutex;
  std::condition_variable idle;
  int under_way = 0;
  std::set<Session*> sessions;  // guarded by the GIL
  std::atomic<bool> exiting{false};
  std::atomic<bool> used{false};
  std::atomic<bool> forked{false};
};

// Never destroyed: threads of the library may still use it when static objects are.
Process& process() {
  static Process& one = *new Process;
  return one;
}

constexpr std::chrono::seconds kLongestExit{10};

}  // namespace

UnderWay::UnderWay() {
  const std::lock_guard<std::mutex> lock(process().mutex);
  ++process().under_way;
}

UnderWay::~UnderWay() {
  const std::lock_guard<std::mutex> lock(process().mutex);
  if (--process().under_way == 0) process().idle.notify_all();
}

bool exiting() { return process().exiting; }
bool is_forked_child() { return process().forked; }

void finish() {
  if (is_forked_child()) return;
  process().exiting = true;
  // Others may end while one is closed.
  while (!process().sessions.empty()) (*process().sessions.begin())->close();
  const auto none = [] { return process().under_way == 0; };
  bool done = false;
  while (!done) {
    {
      const py::gil_scoped_release release;
      std::unique_lock<std::mutex> lock(process().mutex);
      done = !process().idle.wait_for(lock, kLongestExit, none);
    }
    // A thread with the GIL may have begun something since. None can while this one has it.
    const std::lock_guard<std::mutex> lock(process().mutex);
    done = done || none();
  }
}

void check_usable() {
  if (is_forked_child()) {
    raise({Errc::kTransport,
           "this process is a fork of one that has used tfdude, whose threads it lacks: start "
           "processes before, or by multiprocessing's 'spawn' or subprocess"});
  }
  if (exiting()) raise({Errc::kTransport, "the interpreter ends"});  // as SystemExit
}

void note_use() {
  if (process().used.exchange(true)) return;
  pthread_atfork(nullptr, nullptr, [] { process().forked = true; });
}

void call_python(const py::function& function, const std::function<py::object()>& argument) {
  const UnderWay under_way;
  if (exiting()) return;
  const py::gil_scoped_acquire acquire;
  try {
    function(argument());
  } catch (py::error_already_set& error) {
    error.discard_as_unraisable(function);
  }
}

SharedFunction share(py::function function) {
  return SharedFunction(new py::function(std::move(function)), [](py::function* shared) {
    const UnderWay under_way;
    if (exiting()) return;  // the interpreter's memory goes anyway
    const py::gil_scoped_acquire acquire;
    delete shared;
  });
}

Error closed_error() { return {Errc::kTransport, "this client is closed"}; }

Session::Session(std::shared_ptr<Client> client, Milliseconds timeout, std::string partition)
    : client_(std::move(client)), timeout_(timeout), partition_(std::move(partition)) {
  process().sessions.insert(this);
}

void Session::close() {
  process().sessions.erase(this);
  endings_->end_all();
  std::shared_ptr<Client> client = std::move(client_);
  client_ = nullptr;
  if (!client) return;
  if (is_forked_child()) {
    // Its threads are not there to end it.
    static_cast<void>(new std::shared_ptr<Client>(std::move(client)));
    return;
  }
  without_gil([&] {
    // Calls in progress keep it, and end it with the last of them.
    if (client.use_count() > 1) client->end_waits();
    client.reset();
  });
}

std::shared_ptr<Client> Session::client() const {
  check_usable();
  if (!client_) raise(closed_error());
  return client_;
}

}  // namespace tfdude::python
