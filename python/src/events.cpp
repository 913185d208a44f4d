#include <limits>

#include <pybind11/stl.h>

#include "tfdude/types/change.hpp"

#include "bind.hpp"
#include "client.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

using Listening = Ending<Subscription>;
using Waiting = Ending<PendingLookup>;

std::unique_ptr<Listening> on_change(const Session& session, py::function listener) {
  const SharedFunction function = share(std::move(listener));
  return std::make_unique<Listening>(session.call([&](Client& client) {
    return client.on_change([function](const Change& change) {
      call_python(*function, [&] { return py::cast(change); });
    });
  }));
}

/// For events(): changes go to a mailbox.
std::unique_ptr<Listening> subscribe(const Session& session, const MailboxPtr& mailbox) {
  auto listening = std::make_unique<Listening>(session.call([&](Client& client) {
    return client.on_change(
        [mailbox](const Change& change) { mailbox->put([change] { return py::cast(change); }); });
  }));
  session.endings()->add(mailbox);
  return listening;
}

/// Puts the answer of a lookup into a mailbox, as (key, answer): an exception if it failed or was
/// dropped, as when the client is closed.
class Answering {
 public:
  Answering(MailboxPtr mailbox, std::uint64_t key) : mailbox_(std::move(mailbox)), key_(key) {}
  ~Answering() {
    if (!answered_) answer(tl::unexpected(closed_error()));
  }
  Answering(const Answering&) = delete;
  Answering& operator=(const Answering&) = delete;

  void answer(Result<StampedTransform> X) {
    answered_ = true;
    mailbox_->put([key = key_, X = std::move(X)]() -> py::object {
      if (X) return py::make_tuple(key, *X);
      return py::make_tuple(key, exception_of(X.error()));
    });
  }

 private:
  const MailboxPtr mailbox_;
  const std::uint64_t key_;
  bool answered_ = false;
};

/// For lookup_async().
std::unique_ptr<Waiting> start_lookup(const Session& session, const MailboxPtr& mailbox,
                                      std::uint64_t key, const std::string& a, const std::string& b,
                                      const Query& query, Milliseconds wait) {
  auto answering = std::make_shared<Answering>(mailbox, key);
  return std::make_unique<Waiting>(session.call([&](Client& client) {
    return client.lookup_async(a, b, query, wait,
                               [answering = std::move(answering)](Result<StampedTransform> X) {
                                 answering->answer(std::move(X));
                               });
  }));
}

void bind_observing(ClientClass& cls) {
  cls.def(
      "observe",
      [](const Session& session, const std::string& a, const std::string& b, const Transform& X_AB,
         py::handle stamp, double gate, bool independent) {
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        const ObserveOptions options{gate, independent};
        return value_of(
            session.call([&](Client& c) { return c.observe(a, b, X_AB, time, options); }));
      },
      py::arg("a"), py::arg("b"), py::arg("X_AB"), py::arg("stamp") = py::none(), py::kw_only(),
      py::arg("gate") = 0.999, py::arg("independent") = true,
      "Applies a measurement of X_AB, with its own covariance: corrects the edges between a and b\n"
      "according to their uncertainty, whoever owns them.\n\n"
      "gate: the probability with which a correct measurement is accepted; 1 accepts all.\n"
      "independent: False if it may be correlated with the values of the edges. A measurement "
      "that\n"
      "is not accepted changes nothing.");
  cls.def(
      "fuse",
      [](const Session& session, const std::string& id, const Transform& X_PC, py::handle stamp,
         double gate, bool independent) {
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        const ObserveOptions options{gate, independent};
        return value_of(session.call([&](Client& c) { return c.fuse(id, X_PC, time, options); }));
      },
      py::arg("id"), py::arg("X_PC"), py::arg("stamp") = py::none(), py::kw_only(),
      py::arg("gate") = 0.999, py::arg("independent") = true,
      "As observe(), for the edge from a frame's parent to the frame.");
  cls.def(
      "determine",
      [](const Session& session, const std::string& id, const std::string& a, const std::string& b,
         const Transform& X_AB, py::handle stamp) {
        const std::optional<Time> time = to_stamp(stamp, "stamp");
        return value_of(session.call([&](Client& c) { return c.determine(id, a, b, X_AB, time); }));
      },
      py::arg("id"), py::arg("a"), py::arg("b"), py::arg("X_AB"), py::arg("stamp") = py::none(),
      "Gives the edge of frame id the value by which the path from a to b is X_AB. The value\n"
      "replaces the one before, and no other edge is corrected: for poses that a filter has\n"
      "estimated from the same sensors as those before.");
  cls.def(
      "consistency",
      [](const Session& session, const std::string& partition) {
        return value_of(session.call([&](Client& c) { return c.consistency(partition); }));
      },
      py::arg("partition"), "How well covariances agree with the observations, by edge.");
  cls.def(
      "history",
      [](const Session& session, const std::string& id, py::handle timeout) {
        return after_wait(session, timeout,
                          [&](Client& c, Milliseconds wait) { return c.history(id, wait); });
      },
      py::arg("id"), py::kw_only(), py::arg("timeout") = 0.0,
      "Statistics of an edge's history; empty for a static edge. timeout [s]: how long to wait "
      "for\n"
      "the frame.");
  cls.def(
      "histories",
      [](const Session& session, const std::string& partition, py::handle timeout) {
        return after_wait(session, timeout, [&](Client& c, Milliseconds wait) {
          return c.histories(partition, wait);
        });
      },
      py::arg("partition"), py::kw_only(), py::arg("timeout") = 0.0,
      "As history(), for the dynamic edges of a partition, which is waited for.");
}

void bind_clock(ClientClass& cls) {
  cls.def(
      "set_time",
      [](const Session& session, py::handle now) {
        const Time time = to_time(now, "now");
        check(session.call([&](Client& c) { return c.set_time(external_time(time)); }));
      },
      py::arg("now"), "Sets the external clock of this client.");
  cls.def(
      "publish_clock",
      [](const Session& session, py::handle now) {
        const Time time = to_time(now, "now");
        check(session.call([&](Client& c) { return c.publish_clock(external_time(time)); }));
      },
      py::arg("now"), "Sends the time to all participants with an external clock.");
  cls.def(
      "advance_to",
      [](const Session& session, py::handle time, py::handle timeout) {
        const ExternalTime to(to_time(time, "time").time_since_epoch());
        const auto is_timeout = [](const Error& error) { return error.code == Errc::kTimeout; };
        check(value_after_wait(
            session, to_milliseconds(timeout, "timeout"),
            [&](Client& c, Milliseconds wait) { return c.advance_to(to, wait); }, is_timeout));
      },
      py::arg("time"), py::arg("timeout") = 1.0,
      "As publish_clock(), until the clocks of all owners show the time: for simulations in\n"
      "lock-step. Raises TimeoutException after timeout [s], naming an owner.");
}

}  // namespace

void bind_events(py::module_& module, ClientClass& cls) {
  module.def(
      "_seconds",
      [](py::handle duration, const char* what) {
        const Milliseconds wait = to_milliseconds(duration, what);
        if (wait == Milliseconds::max()) return std::numeric_limits<double>::infinity();
        return to_seconds(to_duration(duration, what));
      },
      py::arg("duration"), py::arg("what"));
  py::class_<Mailbox, MailboxPtr>(module, "_Mailbox")
      .def(py::init<>())
      .def("fileno", &Mailbox::fd)
      .def("take", &Mailbox::take)
      .def("wake", &Mailbox::wake)
      .def("end", &Mailbox::end)
      .def_property_readonly("ended", &Mailbox::ended);
  py::class_<Listening>(module, "Subscription",
                        "Keeps a listener attached, until it is closed or no longer referenced.")
      .def("close", &Listening::end,
           "Afterwards the listener is not running and will not run. Waits for a call under way.")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](Listening& self, const py::args&) { self.end(); });
  py::class_<EndableCall>(module, "_Call")
      .def(py::init<>())
      .def("run", &EndableCall::run)
      .def("end", &EndableCall::end);
  py::class_<Waiting>(module, "_PendingLookup").def("cancel", &Waiting::end);
  cls.def("on_change", &on_change, py::arg("listener"),
          "Calls a function with each later Change of the structure, one at a time, from a thread\n"
          "of the library. Returns a Subscription, which must be kept.");
  cls.def("_subscribe", &subscribe, py::arg("mailbox"));
  cls.def(
      "_start_lookup",
      [](const Session& session, const MailboxPtr& mailbox, std::uint64_t key, const std::string& a,
         const std::string& b, py::handle at, py::handle timeout, py::handle extrapolate,
         py::handle age_noise_until, int order, py::handle believed_at) {
        const Milliseconds wait =
            timeout.is_none() ? session.timeout() : to_milliseconds(timeout, "timeout");
        return start_lookup(session, mailbox, key, a, b,
                            to_query(at, extrapolate, age_noise_until, order, believed_at), wait);
      },
      py::arg("mailbox"), py::arg("key"), py::arg("a"), py::arg("b"), py::arg("at"),
      py::arg("timeout"), py::arg("extrapolate"), py::arg("age_noise_until"), py::arg("order"),
      py::arg("believed_at") = py::none());
  bind_observing(cls);
  bind_clock(cls);
}

}  // namespace tfdude::python
