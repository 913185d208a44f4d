#include <algorithm>
#include <chrono>

#include <pybind11/stl.h>

#include "tfdude/client/watch.hpp"

#include "bind.hpp"
#include "client.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

using Steady = std::chrono::steady_clock;

/// A watch of the library, and the client that it ends with.
template <class Watch>
struct Watching {
  Watch watch;
  std::shared_ptr<Endings> endings;
  std::weak_ptr<const Session> session;

  /// @throws TransformException once nothing new comes
  void check_open() const {
    check_usable();
    const auto client = session.lock();
    if (!client || client->closed())
      raise({Errc::kTransport, "the client of this watch is closed"});
  }
};
using Path = Watching<PathWatch>;
using WatchedEdges = Watching<EdgesWatch>;
using Listening = Ending<Subscription>;

/// In slices, so that signals and the end of the interpreter are noticed.
template <class Watch>
bool wait_for_more(const Watching<Watch>& self, std::uint64_t messages, py::handle timeout) {
  const Milliseconds wait = to_milliseconds(timeout, "timeout");
  const bool forever = wait == Milliseconds::max();
  const Steady::time_point end = forever ? Steady::time_point::max() : Steady::now() + wait;
  check_usable();
  while (true) {
    const Steady::time_point slice = std::min(end, Steady::now() + kLook);
    if (without_gil([&] { return self.watch.wait_for_more(messages, slice); })) return true;
    check_interrupted();
    self.check_open();
    if (!forever && Steady::now() >= end) return false;
  }
}

template <class Watch>
std::unique_ptr<Listening> listen(const Watching<Watch>& self, const MailboxPtr& mailbox) {
  check_usable();
  self.endings->add(mailbox);
  return std::make_unique<Listening>(self.watch.on_news([mailbox] { mailbox->wake(); }));
}

template <class Watch>
void bind_common(py::class_<Watching<Watch>>& cls) {
  using Self = Watching<Watch>;
  cls.def(
      "check",
      [](const Self& self) {
        check_usable();
        check(self.watch.health());
      },
      "Raises UnreachableException if an owner is not reachable: the last values are used then.");
  cls.def_property_readonly(
      "messages",
      [](const Self& self) {
        check_usable();
        return self.watch.messages();
      },
      "The number of received messages with new data.");
  cls.def("wait_for_more", &wait_for_more<Watch>, py::arg("messages"), py::arg("timeout") = 1.0,
          "Waits until `messages` exceeds this number; False after timeout [s]. Raises\n"
          "TransformException once the client is closed.");
  cls.def("_listen", &listen<Watch>, py::arg("mailbox"));
}

/// In slices, as wait_for_more().
StampedTransform wait_next(Path& self, py::handle timeout) {
  const Milliseconds wait = to_milliseconds(timeout, "timeout");
  const bool forever = wait == Milliseconds::max();
  const Steady::time_point end = forever ? Steady::time_point::max() : Steady::now() + wait;
  check_usable();
  while (true) {
    const auto left = std::chrono::ceil<Milliseconds>(end - Steady::now());
    const Milliseconds slice = std::max(std::min(left, kLook), Milliseconds(0));
    const Steady::time_point until = Steady::now() + slice;
    auto next = without_gil([&] { return self.watch.wait_next(slice); });
    if (next) return *std::move(next);
    check_interrupted();
    self.check_open();
    // Before the end of the slice: the path has ended.
    const bool is_last = (!forever && left <= slice) || Steady::now() < until;
    if (is_last) raise(of_whole_wait(next.error(), slice, wait));
  }
}

std::unique_ptr<Listening> on_value(const Path& self, py::function callback) {
  self.check_open();
  const SharedFunction function = share(std::move(callback));
  return without_gil([&] {
    return std::make_unique<Listening>(
        self.watch.on_value([function](const Result<StampedTransform>& X) {
          call_python(*function, [&]() -> py::object {
            if (X) return py::cast(*X);
            return exception_of(X.error());
          });
        }));
  });
}

WatchOptions options_of(double rate, bool composed, py::handle span) {
  WatchOptions options;
  options.rate = rate;
  options.composed = composed;
  if (!span.is_none()) options.timing.span = not_negative(to_duration(span, "span"), "span");
  return options;
}

template <class Watch>
std::unique_ptr<Watching<Watch>> made(const std::shared_ptr<Session>& session,
                                      Result<Watch>&& watch) {
  return std::make_unique<Watching<Watch>>(
      Watching<Watch>{value_of(std::move(watch)), session->endings(), session});
}

void bind_path(py::module_& module, ClientClass& client) {
  py::class_<Path> cls(
      module, "PathWatch",
      "A path whose owners push its changes, so that it is read from this process's\n"
      "memory. It is watched while this object exists.\n\n"
      "`async for X in watch` gets the newest transform whenever there is a new one.");
  cls.def(
      "latest",
      [](const Path& self) {
        check_usable();
        return value_of(self.watch.latest());
      },
      "X_AB at the newest instant that all dynamic edges of the path have received.");
  cls.def(
      "lookup",
      [](const Path& self, py::handle at, py::handle extrapolate, py::handle age_noise_until,
         int order) {
        check_usable();
        return value_of(self.watch.lookup(to_query(at, extrapolate, age_noise_until, order)));
      },
      py::arg("at") = py::none(), py::kw_only(), py::arg("extrapolate") = 0.0,
      py::arg("age_noise_until") = py::none(), py::arg("order") = 2,
      "As Client.lookup(), from the received values.");
  cls.def(
      "wait_next", &wait_next, py::arg("timeout") = 1.0,
      "Waits for a value that this object has not returned yet: the first time for the newest\n"
      "one. Values between two calls are not kept. Raises TimeoutException after timeout [s],\n"
      "TransformException once the client is closed. The end of the path is raised at once, and\n"
      "by the next call, which waits for its return, after timeout.");
  cls.def(
      "on_value", &on_value, py::arg("callback"),
      "Calls a function with the newest transform, and then when there is another one, from a\n"
      "thread of the library, one call at a time; or with an exception, when there is none any\n"
      "more. Returns a Subscription, which must be kept. Ends with it, this object or the client;\n"
      "of a closed client it raises TransformException.");
  bind_common(cls);
  client.def(
      "watch",
      [](const std::shared_ptr<Session>& session, const std::string& a, const std::string& b,
         double rate, bool composed, py::handle span, py::handle timeout) {
        const WatchOptions options = options_of(rate, composed, span);
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        const auto ready = [&](Milliseconds left) {
          return wait_for_lookup(*session, a, b, {}, left);
        };
        return made(session, call_when_ready(*session, wait, ready,
                                             [&](Client& c) { return c.watch(a, b, options); }));
      },
      py::arg("a"), py::arg("b"), py::kw_only(), py::arg("rate") = 0.0, py::arg("composed") = false,
      py::arg("span") = py::none(), py::arg("timeout") = 0.0,
      "Asks the owners of the path to push its changes.\n\n"
      "rate [Hz]: the most at which an owner sends; 0: every sample. composed: one transform for\n"
      "each partition instead of all its edges. span [s]: how much history is kept here. timeout\n"
      "[s]: how long to wait for missing frames and data.");
}

void bind_edges(py::module_& module, ClientClass& client) {
  py::class_<WatchedEdges> cls(module, "EdgesWatch",
                               "Edges whose owners push their changes; see Client.watch_edges().");
  cls.def(
      "lookup",
      [](const WatchedEdges& self, const std::string& a, const std::string& b, py::handle at,
         py::handle extrapolate, py::handle age_noise_until, int order) {
        check_usable();
        return value_of(self.watch.lookup(a, b, to_query(at, extrapolate, age_noise_until, order)));
      },
      py::arg("a"), py::arg("b"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("extrapolate") = 0.0, py::arg("age_noise_until") = py::none(), py::arg("order") = 2,
      "As Client.lookup(), over the watched edges.");
  bind_common(cls);
  client.def(
      "watch_edges",
      [](const std::shared_ptr<Session>& session, const std::vector<std::string>& ids, double rate,
         py::handle span, py::handle timeout) {
        const WatchOptions options = options_of(rate, false, span);
        return made(session, Result<EdgesWatch>(
                                 after_wait(*session, timeout, [&](Client& c, Milliseconds wait) {
                                   return c.watch_edges(ids, options, wait);
                                 })));
      },
      py::arg("ids"), py::kw_only(), py::arg("rate") = 0.0, py::arg("span") = py::none(),
      py::arg("timeout") = 0.0,
      "As watch(), for the edges of these frames, wherever they are. timeout [s]: how long to "
      "wait\n"
      "for the frames.");
}

}  // namespace

void bind_watches(py::module_& module, ClientClass& cls) {
  bind_path(module, cls);
  bind_edges(module, cls);
}

}  // namespace tfdude::python
