#include "many.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "client.hpp"
#include "waiting.hpp"

namespace tfdude::python {
namespace {

/// The stamp of a transform that holds for all times; no instant is negative.
constexpr std::int64_t kNoStamp = -1;
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

// Arrays with a row for each transform, of which some may be missing: NaN.

py::array_t<double> pose_rows(std::size_t count) {
  return py::array_t<double>({static_cast<py::ssize_t>(count), kPoseNumbers});
}
void write_pose(const Transform* X, double* row) {
  if (X == nullptr) {
    std::fill_n(row, kPoseNumbers, kNothing);
    return;
  }
  const Eigen::Vector3d p = X->pose.translation();
  const Eigen::Quaterniond q = X->pose.rotation();
  std::copy_n(p.data(), 3, row);
  std::copy_n(q.coeffs().data(), 4, row + 3);  // x, y, z, w
}
py::array_t<double> covariance_rows(std::size_t count) {
  return py::array_t<double>({static_cast<py::ssize_t>(count), py::ssize_t{6}, py::ssize_t{6}});
}
void write_covariance(const Transform* X, double* row) {
  if (X == nullptr) {
    std::fill_n(row, kCovarianceNumbers, kNothing);
    return;
  }
  const Covariance::Upper& upper = X->covariance.of_specified().upper();
  std::size_t k = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) row[6 * i + j] = row[6 * j + i] = upper[k++];
  }
}

/// The answer to lookup_many().
struct Batch {
  std::vector<Result<StampedTransform>> X;

  [[nodiscard]] const StampedTransform* at(std::size_t i) const { return X[i] ? &*X[i] : nullptr; }
  [[nodiscard]] const StampedTransform* incomplete() const {
    for (const auto& one : X) {
      if (one && !one->covariance.complete()) return &*one;
    }
    return nullptr;
  }
};

py::array poses(const Batch& batch) {
  auto array = pose_rows(batch.X.size());
  for (std::size_t i = 0; i < batch.X.size(); ++i) {
    write_pose(batch.at(i), array.mutable_data() + static_cast<std::size_t>(kPoseNumbers) * i);
  }
  return array;
}

py::array covariances(const Batch& batch) {
  auto array = covariance_rows(batch.X.size());
  for (std::size_t i = 0; i < batch.X.size(); ++i) {
    write_covariance(batch.at(i), array.mutable_data() + kCovarianceNumbers * i);
  }
  return array;
}

py::array stamps(const Batch& batch) {
  py::array_t<std::int64_t> array(static_cast<py::ssize_t>(batch.X.size()));
  std::transform(batch.X.begin(), batch.X.end(), array.mutable_data(),
                 [](const auto& X) { return X && X->stamp ? nanoseconds(*X->stamp) : kNoStamp; });
  return array;
}

std::size_t checked_index(py::ssize_t i, std::size_t count) {
  const auto size = static_cast<py::ssize_t>(count);
  if (i < 0) i += size;
  if (i < 0 || i >= size) throw py::index_error("no such transform");
  return static_cast<std::size_t>(i);
}

void bind_batch(py::module_& module) {
  py::class_<Batch>(
      module, "Batch",
      "Many transforms as arrays: the answer to lookup_many(). batch[i] is one, or raises why\n"
      "there is none; arrays have NaN for it.")
      .def("__len__", [](const Batch& batch) { return batch.X.size(); })
      .def("__getitem__",
           [](const Batch& batch, py::ssize_t i) {
             const auto& one = batch.X[checked_index(i, batch.X.size())];
             if (!one) raise(one.error());
             return *one;
           })
      .def_property_readonly("poses", &poses,
                             "(N, 7): translation [m], then quaternion (x, y, z, w).")
      .def_property_readonly(
          "complete", [](const Batch& batch) { return batch.incomplete() == nullptr; },
          "Whether the covariance of each is complete.")
      .def_property_readonly(
          "covariances",
          [](const Batch& batch) {
            if (const auto* X = batch.incomplete()) require_complete(py::cast(*X));
            return covariances(batch);
          },
          "(N, 6, 6). Raises UnspecifiedCovariance if one is not complete.")
      .def_property_readonly("covariances_of_specified", &covariances,
                             "(N, 6, 6), of those edges that have one.")
      .def_property_readonly("stamps", &stamps,
                             "(N,) int64 [ns]; -1 for those that hold for all times.")
      .def_property_readonly(
          "errors",
          [](const Batch& batch) {
            py::dict errors;
            for (std::size_t i = 0; i < batch.X.size(); ++i) {
              if (!batch.X[i]) errors[py::int_(i)] = exception_of(batch.X[i].error());
            }
            return errors;
          },
          "The exceptions of those without an answer, by index.")
      .def("__repr__", [](const Batch& batch) {
        const auto failed = std::count_if(batch.X.begin(), batch.X.end(),
                                          [](const auto& one) { return !one.has_value(); });
        return "Batch(" + std::to_string(batch.X.size()) + " transforms" +
               (failed > 0 ? ", " + std::to_string(failed) + " without an answer)" : ")");
      });
}

/// The answer to trajectory(). Its arrays are made once.
struct TrajectoryArrays {
  Trajectory all;
  std::vector<Time> instants;
  bool complete = true;
  py::object poses{};
  py::object covariances{};
};

py::array trajectory_covariances(TrajectoryArrays& self) {
  if (!self.covariances) {
    auto array = covariance_rows(self.all.X_AB.size());
    for (std::size_t i = 0; i < self.all.X_AB.size(); ++i) {
      const auto& X = self.all.X_AB[i];
      write_covariance(X ? &*X : nullptr, array.mutable_data() + kCovarianceNumbers * i);
    }
    self.covariances = std::move(array);
  }
  return self.covariances;
}

py::array trajectory_poses(TrajectoryArrays& self) {
  if (!self.poses) {
    auto array = pose_rows(self.all.X_AB.size());
    for (std::size_t i = 0; i < self.all.X_AB.size(); ++i) {
      const auto& X = self.all.X_AB[i];
      write_pose(X ? &*X : nullptr,
                 array.mutable_data() + static_cast<std::size_t>(kPoseNumbers) * i);
    }
    self.poses = std::move(array);
  }
  return self.poses;
}

const MissingInstants* missing_at(const Trajectory& trajectory, std::size_t i) {
  for (const MissingInstants& one : trajectory.missing) {
    if (i >= one.first && i < one.first + one.count) return &one;
  }
  return nullptr;
}

void bind_trajectory(py::module_& module) {
  py::class_<TrajectoryArrays>(
      module, "Trajectory",
      "X_AB at many instants, as arrays: the answer to trajectory(). trajectory[i] is one, or\n"
      "raises why there is none; arrays have NaN for it.")
      .def("__len__", [](const TrajectoryArrays& self) { return self.instants.size(); })
      .def("__getitem__",
           [](const TrajectoryArrays& self, py::ssize_t at) {
             const std::size_t i = checked_index(at, self.instants.size());
             const auto& X = self.all.X_AB[i];
             if (!X) raise(missing_at(self.all, i)->error);
             return *X;
           })
      .def_property_readonly("poses", &trajectory_poses,
                             "(N, 7): translation [m], then quaternion (x, y, z, w).")
      .def_property_readonly(
          "complete", [](const TrajectoryArrays& self) { return self.complete; },
          "Whether the covariance of each is complete.")
      .def_property_readonly(
          "covariances",
          [](TrajectoryArrays& self) {
            if (!self.complete) {
              StampedTransform incomplete;
              incomplete.basis = self.all.basis;
              require_complete(py::cast(incomplete));
            }
            return trajectory_covariances(self);
          },
          "(N, 6, 6). Raises UnspecifiedCovariance if one is not complete.")
      .def_property_readonly("covariances_of_specified", &trajectory_covariances,
                             "(N, 6, 6), of those edges that have one.")
      .def_property_readonly(
          "stamps",
          [](const TrajectoryArrays& self) {
            py::array_t<std::int64_t> array(static_cast<py::ssize_t>(self.instants.size()));
            std::transform(self.instants.begin(), self.instants.end(), array.mutable_data(),
                           [](Time t) { return nanoseconds(t); });
            return array;
          },
          "(N,) int64 [ns]: the instants that were asked for.")
      .def_property_readonly(
          "valid",
          [](const TrajectoryArrays& self) {
            py::array_t<bool> array(static_cast<py::ssize_t>(self.all.X_AB.size()));
            std::transform(self.all.X_AB.begin(), self.all.X_AB.end(), array.mutable_data(),
                           [](const auto& X) { return X.has_value(); });
            return array;
          },
          "(N,) bool: whether there is an answer.")
      .def_property_readonly(
          "missing",
          [](const TrajectoryArrays& self) {
            py::list all;
            for (const MissingInstants& one : self.all.missing) {
              all.append(py::make_tuple(one.first, one.count, exception_of(one.error)));
            }
            return all;
          },
          "[(first index, how many, why)] of consecutive instants without an answer.")
      .def_property_readonly(
          "unspecified", [](const TrajectoryArrays& self) { return self.all.basis.unspecified; },
          "The edges whose covariance is unspecified.")
      .def_property_readonly(
          "sources", [](const TrajectoryArrays& self) { return self.all.basis.sources; },
          "Error sources that edges share.")
      .def("__repr__", [](const TrajectoryArrays& self) {
        std::size_t missing = 0;
        for (const MissingInstants& one : self.all.missing) missing += one.count;
        return "Trajectory(" + std::to_string(self.instants.size()) + " instants" +
               (missing > 0 ? ", " + std::to_string(missing) + " without an answer)" : ")");
      });
}

void wait_for(const Session& session, const std::string& a, const std::string& b,
              const Query& query, std::optional<Time> at, Milliseconds wait) {
  if (wait <= Milliseconds(0)) return;
  Query last = query;
  last.at = at;
  (void)wait_for_lookup(session, a, b, last, wait);
}

/// As Client::trajectory(), which waits for the last instant.
Result<Trajectory> trajectory(const Session& session, const std::string& a, const std::string& b,
                              const std::vector<Time>& instants, const Query& query,
                              Milliseconds wait) {
  const auto ready = [&](Milliseconds left) -> Result<void> {
    if (instants.empty()) return {};
    // Without its answer, the others may have theirs.
    wait_for(session, a, b, query, *std::max_element(instants.begin(), instants.end()), left);
    return {};
  };
  return call_when_ready(session, wait, ready,
                         [&](Client& c) { return c.trajectory(a, b, instants, query); });
}

Batch at_one_instant(const Session& session, const std::vector<FramePair>& pairs,
                     const Query& query, Milliseconds wait) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::min(wait, Milliseconds(1 << 30));
  for (auto pause = Milliseconds(1);; pause = std::min(2 * pause, kLook)) {
    auto found = session.call([&](Client& c) { return c.lookup_many(pairs, query); });
    const auto failed = std::find_if(found.begin(), found.end(), [&](const auto& one) {
      return !one && is_worth_waiting(one.error().code, query);
    });
    const auto left = std::chrono::ceil<Milliseconds>(end - Clock::now());
    if (failed == found.end() || left <= Milliseconds(0)) return {std::move(found)};
    // Alone it may have an answer at once, but not at the instant of the others.
    const auto next = Clock::now() + std::min(pause, left);
    const FramePair& pair = pairs[static_cast<std::size_t>(failed - found.begin())];
    wait_for(session, pair.a, pair.b, query, query.at, left);
    check_interrupted();
    without_gil([&] { std::this_thread::sleep_until(next); });
  }
}

Batch of_trajectory(Trajectory&& trajectory, const std::vector<Time>& instants) {
  Batch batch;
  for (std::size_t i = 0; i < instants.size(); ++i) {
    if (!trajectory.X_AB[i]) {
      batch.X.push_back(tl::unexpected(missing_at(trajectory, i)->error));
      continue;
    }
    StampedTransform X{*trajectory.X_AB[i], instants[i], {}};
    if (!X.covariance.complete()) X.basis = trajectory.basis;
    batch.X.emplace_back(std::move(X));
  }
  return batch;
}

/// One lookup for each pair and instant, of which there are as many, or one for all.
Batch lookup_many(const Session& session, std::vector<FramePair> pairs, py::handle at,
                  py::handle timeout, py::handle extrapolate, int order, bool strict,
                  py::handle believed_at) {
  bool many = false;
  const auto stamps = to_stamps(at, many, "at");
  Query query = to_query(py::none(), extrapolate, py::none(), order, believed_at);
  const Milliseconds wait = to_milliseconds(timeout, "timeout");
  if (many && pairs.size() > 1 && stamps.size() > 1 && pairs.size() != stamps.size()) {
    throw py::value_error(std::to_string(pairs.size()) + " pairs, but " +
                          std::to_string(stamps.size()) +
                          " instants: there must be as many, or one of either");
  }
  Batch batch;
  if (pairs.empty() || stamps.empty()) return batch;
  if (stamps.size() == 1) {
    query.at = stamps.front();
    batch = at_one_instant(session, pairs, query, wait);
  } else if (pairs.size() == 1 &&
             std::all_of(stamps.begin(), stamps.end(), [](const auto& t) { return t; })) {
    std::vector<Time> instants;
    for (const auto& stamp : stamps) instants.push_back(*stamp);
    batch = of_trajectory(
        value_of(trajectory(session, pairs[0].a, pairs[0].b, instants, query, wait)), instants);
  } else {
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      query.at = stamps[i];
      Batch one = at_one_instant(session, {pairs[pairs.size() == 1 ? 0 : i]}, query, wait);
      batch.X.push_back(std::move(one.X.front()));
    }
  }
  if (!strict) return batch;
  for (const auto& one : batch.X) {
    if (!one) raise(one.error());
  }
  return batch;
}

}  // namespace

py::object trajectory_object(Trajectory trajectory, std::vector<Time> instants) {
  TrajectoryArrays arrays{std::move(trajectory), std::move(instants)};
  for (const auto& X : arrays.all.X_AB) {
    arrays.complete = arrays.complete && (!X || X->covariance.complete());
  }
  return py::cast(std::move(arrays));
}

void bind_many(py::module_& module, ClientClass& cls) {
  bind_batch(module);
  bind_trajectory(module);
  constexpr const char* kLookupMany =
      "Many lookups at one common instant, in one request to each owner: lookup_many(pairs) of\n"
      "ids (a, b), or lookup_many(a, frames).\n\n"
      "at: the instant; None: the newest for which all dynamic edges have data. An array of N\n"
      "instants: for one pair, or one each. timeout [s]: how long to wait for all of them.\n"
      "strict: raises the first error. If not, a pair without an answer does not count for the\n"
      "instant, and Batch.errors says why. Otherwise as lookup().";
  cls.def(
      "lookup_many",
      [](const Session& session, const std::vector<std::pair<std::string, std::string>>& pairs,
         py::handle at, py::handle timeout, py::handle extrapolate, int order, bool strict,
         py::handle believed_at) {
        std::vector<FramePair> all;
        for (const auto& pair : pairs) all.push_back({pair.first, pair.second});
        return lookup_many(session, std::move(all), at, timeout, extrapolate, order, strict,
                           believed_at);
      },
      py::arg("pairs"), py::arg("at") = py::none(), py::kw_only(), py::arg("timeout") = 0.0,
      py::arg("extrapolate") = 0.0, py::arg("order") = 2, py::arg("strict") = true,
      py::arg("believed_at") = py::none(), kLookupMany);
  cls.def(
      "lookup_many",
      [](const Session& session, const std::string& a, const std::vector<std::string>& frames,
         py::handle at, py::handle timeout, py::handle extrapolate, int order, bool strict,
         py::handle believed_at) {
        std::vector<FramePair> all;
        for (const std::string& frame : frames) all.push_back({a, frame});
        return lookup_many(session, std::move(all), at, timeout, extrapolate, order, strict,
                           believed_at);
      },
      py::arg("a"), py::arg("frames"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("timeout") = 0.0, py::arg("extrapolate") = 0.0, py::arg("order") = 2,
      py::arg("strict") = true, py::arg("believed_at") = py::none(), kLookupMany);
  cls.def(
      "trajectory",
      [](const Session& session, const std::string& a, const std::string& b, py::handle instants,
         py::handle timeout, py::handle extrapolate, int order, py::handle believed_at) {
        std::vector<Time> times = to_instants(instants, "instants");
        const Query query = to_query(py::none(), extrapolate, py::none(), order, believed_at);
        auto found = trajectory(session, a, b, times, query, to_milliseconds(timeout, "timeout"));
        return trajectory_object(value_of(std::move(found)), std::move(times));
      },
      py::arg("a"), py::arg("b"), py::arg("instants"), py::kw_only(), py::arg("timeout") = 0.0,
      py::arg("extrapolate") = 0.0, py::arg("order") = 2, py::arg("believed_at") = py::none(),
      "X_AB at many instants, in any order: a Trajectory, with arrays (N, 7) and (N, 6, 6).\n\n"
      "instants: an array of int [ns], float [s] or datetime64, or a sequence of instants.\n"
      "timeout [s]: how long to wait for the last of them. Instants without data do not raise.\n"
      "believed_at: as in lookup().");
}

}  // namespace tfdude::python
