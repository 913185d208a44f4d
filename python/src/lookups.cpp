#include <pybind11/stl.h>

#include "bind.hpp"
#include "client.hpp"
#include "points.hpp"
#include "possible.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

/// tf2's users pass 0 for the newest transform.
Query tf2_query(py::handle time) {
  Query query;
  query.at = to_stamp(time, "time");
  if (query.at && nanoseconds(*query.at) == 0) query.at.reset();
  return query;
}

StampedTransform lookup(const Session& session, const std::string& a, const std::string& b,
                        const Query& query, Milliseconds wait) {
  if (wait > Milliseconds(0)) return value_of(wait_for_lookup(session, a, b, query, wait));
  return value_of(session.call([&](Client& c) { return c.lookup(a, b, query); }));
}

Possible can_lookup(const Session& session, const std::string& a, const std::string& b,
                    const Query& query, Milliseconds wait) {
  if (wait > Milliseconds(0)) {
    const auto found = wait_for_lookup(session, a, b, query, wait);
    return found ? Possible{} : Possible{found.error()};
  }
  const auto can = session.call([&](Client& c) { return c.can_lookup(a, b, query); });
  return can ? Possible{} : Possible{can.error()};
}

void bind_possible(py::module_& module, ClientClass& cls) {
  py::class_<Possible>(module, "Possible",
                       "Whether a lookup would succeed: true or false, with the reason.")
      .def("__bool__", [](const Possible& self) { return !self.why_not; })
      .def_property_readonly(
          "error",
          [](const Possible& self) -> py::object {
            if (!self.why_not) return py::none();
            return exception_of(*self.why_not);
          },
          "The exception that lookup() would raise; None if it would not.")
      .def("__repr__", [](const Possible& self) {
        return self.why_not ? "Possible(False: " + self.why_not->message + ")"
                            : std::string("Possible(True)");
      });
  cls.def(
      "can_lookup",
      [](const Session& session, const std::string& a, const std::string& b, py::handle at,
         py::handle timeout, py::handle extrapolate) {
        return can_lookup(session, a, b, to_query(at, extrapolate, py::none(), 2),
                          to_milliseconds(timeout, "timeout"));
      },
      py::arg("a"), py::arg("b"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("timeout") = 0.0, py::arg("extrapolate") = 0.0,
      "Whether lookup() would succeed, waiting for it up to timeout [s]: a Possible, which is "
      "true\n"
      "or false and says why.");
}

void bind_own(ClientClass& cls) {
  cls.def(
      "lookup",
      [](const Session& session, const std::string& a, const std::string& b, py::handle at,
         py::handle timeout, py::handle extrapolate, py::handle age_noise_until, int order,
         bool last_known, py::handle believed_at) {
        Query query = to_query(at, extrapolate, age_noise_until, order, believed_at);
        query.last_known = last_known;
        return lookup(session, a, b, query, to_milliseconds(timeout, "timeout"));
      },
      py::arg("a"), py::arg("b"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("timeout") = 0.0, py::arg("extrapolate") = 0.0,
      py::arg("age_noise_until") = py::none(), py::arg("order") = 2, py::arg("last_known") = false,
      py::arg("believed_at") = py::none(),
      "X_AB, the pose of frame b in frame a.\n\n"
      "at: the instant; None: the newest for which all dynamic edges have data. timeout [s]: how\n"
      "long to wait for missing frames and data; inf: without limit. extrapolate [s]: how far an\n"
      "edge may be extrapolated. age_noise_until: adds process noise until this instant. order: 2\n"
      "or 4, of the covariance's propagation. last_known: where an owner on this computer is "
      "gone,\n"
      "the last values that this client could read in its memory; `lost` of the result names "
      "it.\n"
      "believed_at: what the owners had committed by this instant, without what came later, if "
      "they\n"
      "remember it (`believed` of their history); otherwise an ExtrapolationException says since\n"
      "when that can be asked for.\n\n"
      "Raises LookupException (no such frame), ConnectivityException (no common root),\n"
      "ExtrapolationException (no data for the instant).");
  cls.def(
      "lookup_full",
      [](const Session& session, const std::string& a, py::handle at_a, const std::string& b,
         py::handle at_b, const std::string& fixed, py::handle timeout) {
        Query query_a;
        Query query_b;
        query_a.at = to_stamp(at_a, "at_a");
        query_b.at = to_stamp(at_b, "at_b");
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        const auto ready = [&](Milliseconds left) {
          auto found = wait_for_lookup(session, fixed, a, query_a, left);
          if (found) found = wait_for_lookup(session, fixed, b, query_b, left);
          return found;
        };
        return value_of(call_when_ready(session, wait, ready, [&](Client& c) {
          return c.lookup(a, query_a, b, query_b, fixed);
        }));
      },
      py::arg("a"), py::arg("at_a"), py::arg("b"), py::arg("at_b"), py::arg("fixed"), py::kw_only(),
      py::arg("timeout") = 0.0,
      "Frame b at one instant, seen from frame a at another, through a frame that is assumed\n"
      "fixed in between. timeout [s]: how long to wait for the data of each.");
  cls.def(
      "transform",
      [](const Session& session, const std::string& a, const std::string& b, py::handle what,
         py::handle at, py::handle covariance, bool direction, int order,
         py::handle timeout) -> py::object {
        Query query;
        query.at = to_stamp(at, "at");
        query.order = to_order(order);
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        if (py::isinstance<Transform>(what)) {
          if (!covariance.is_none() || direction) {
            throw py::type_error("a Transform has its own covariance, and no direction");
          }
          const auto& X_BC = what.cast<const Transform&>();
          const auto ready = [&](Milliseconds left) {
            return wait_for_lookup(session, a, b, query, left);
          };
          return py::cast(value_of(call_when_ready(
              session, wait, ready, [&](Client& c) { return c.transform(a, b, X_BC, query); })));
        }
        Points points = to_points(what, covariance, direction);
        return transformed(py::cast(lookup(session, a, b, query, wait)), std::move(points),
                           query.order);
      },
      py::arg("a"), py::arg("b"), py::arg("what"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("covariance") = py::none(), py::arg("direction") = false, py::arg("order") = 2,
      py::arg("timeout") = 0.0,
      "Points (3,) or (N, 3) of frame b, in frame a: as lookup(a, b).transform(what, ...). Of a\n"
      "Transform X_BC with an error of its own: X_AC. timeout [s]: how long to wait for the data.\n"
      "Raises as lookup(). transform_cloud() is for many points.");
  cls.def(
      "velocity",
      [](const Session& session, const std::string& a, const std::string& b, py::handle at,
         py::handle over, py::handle timeout) {
        VelocityQuery query;
        query.at = to_stamp(at, "at");
        query.over = to_duration(over, "over");
        Query middle;
        middle.at = query.at;
        return value_of(value_after_wait(
            session, to_milliseconds(timeout, "timeout"),
            [&](Client& c, Milliseconds slice) { return c.velocity(a, b, query, slice); },
            [&](const Error& error) { return is_worth_waiting(error.code, middle); }));
      },
      py::arg("a"), py::arg("b"), py::arg("at") = py::none(), py::kw_only(), py::arg("over") = 0.1,
      py::arg("timeout") = 0.0,
      "The mean velocity of frame b in frame a over an interval of `over` seconds around `at`, or\n"
      "up to the newest data. timeout [s]: how long to wait for the data of `at`.");
}

void bind_as_tf2(ClientClass& cls) {
  cls.def(
      "lookup_transform",
      [](const Session& session, const std::string& target, const std::string& source,
         py::handle time, py::handle timeout) {
        return lookup(session, target, source, tf2_query(time),
                      to_milliseconds(timeout, "timeout"));
      },
      py::arg("target_frame"), py::arg("source_frame"), py::arg("time") = py::none(),
      py::arg("timeout") = 0.0,
      "As tf2's: the pose of the source frame in the target frame, which takes points from source\n"
      "to target. time: None or 0: the newest. It is lookup(target_frame, source_frame).");
  cls.def(
      "can_transform",
      [](const Session& session, const std::string& target, const std::string& source,
         py::handle time, py::handle timeout) {
        const Query query = tf2_query(time);
        const Milliseconds wait = to_milliseconds(timeout, "timeout");
        return !can_lookup(session, target, source, query, wait).why_not;
      },
      py::arg("target_frame"), py::arg("source_frame"), py::arg("time") = py::none(),
      py::arg("timeout") = 0.0,
      "As tf2's: whether lookup_transform() would succeed, waiting for it up to timeout [s].");
  cls.def(
      "wait_for_transform",
      [](const Session& session, const std::string& target, const std::string& source,
         py::handle time, py::handle timeout) {
        static_cast<void>(
            lookup(session, target, source, tf2_query(time), to_milliseconds(timeout, "timeout")));
      },
      py::arg("target_frame"), py::arg("source_frame"), py::arg("time") = py::none(),
      py::arg("timeout") = 1.0,
      "As tf's: returns when lookup_transform() would succeed; raises why not after timeout [s].");
}

}  // namespace

void bind_lookups(py::module_& module, ClientClass& cls) {
  bind_possible(module, cls);
  bind_own(cls);
  bind_as_tf2(cls);
}

}  // namespace tfdude::python
