#include "batches.hpp"

#include <algorithm>
#include <atomic>
#include <future>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "client.hpp"

namespace tfdude::python {
namespace {

constexpr py::ssize_t kPoseNumbers = 7;
constexpr std::size_t kCovarianceNumbers = 36;
/// The stamp of a transform that holds for all times; no instant is negative.
constexpr std::int64_t kNoStamp = -1;

template <class T>
T of_row(Result<T>&& result, std::size_t row) {
  if (!result)
    raise({result.error().code, "row " + std::to_string(row) + ": " + result.error().message});
  return *std::move(result);
}

Pose pose_of(const double* numbers, std::size_t row) {
  return of_row(Pose::create({numbers[6], numbers[3], numbers[4], numbers[5]},
                             {numbers[0], numbers[1], numbers[2]}),
                row);
}

std::vector<Transform> of_sequence(py::handle transforms, std::size_t count) {
  const auto sequence = py::reinterpret_borrow<py::sequence>(transforms);
  if (sequence.size() != count) {
    throw py::value_error("poses must be " + std::to_string(count) + ", not " +
                          std::to_string(sequence.size()));
  }
  std::vector<Transform> X;
  X.reserve(count);
  for (const py::handle one : sequence) X.push_back(one.cast<const Transform&>());
  return X;
}

bool is_sequence_of_transforms(py::handle poses) {
  if (py::isinstance<py::array>(poses) || !py::isinstance<py::sequence>(poses)) return false;
  const auto sequence = py::reinterpret_borrow<py::sequence>(poses);
  return sequence.size() > 0 && py::isinstance<Transform>(py::object(sequence[0]));
}

/// The answer to lookup_many().
struct Batch {
  std::vector<StampedTransform> X;

  [[nodiscard]] bool complete() const {
    return std::all_of(X.begin(), X.end(),
                       [](const StampedTransform& one) { return one.covariance.complete(); });
  }
};

py::array poses(const Batch& batch) {
  py::array_t<double> array({static_cast<py::ssize_t>(batch.X.size()), kPoseNumbers});
  double* out = array.mutable_data();
  for (const StampedTransform& X : batch.X) {
    const Eigen::Vector3d p = X.pose.translation();
    const Eigen::Quaterniond q = X.pose.rotation();
    out = std::copy_n(p.data(), 3, out);
    out = std::copy_n(q.coeffs().data(), 4, out);  // x, y, z, w
  }
  return array;
}

py::array covariances(const Batch& batch) {
  py::array_t<double> array(
      {static_cast<py::ssize_t>(batch.X.size()), py::ssize_t{6}, py::ssize_t{6}});
  double* out = array.mutable_data();
  for (const StampedTransform& X : batch.X) {
    const Matrix6d symmetric = X.covariance.of_specified().matrix();
    out = std::copy_n(symmetric.data(), kCovarianceNumbers, out);
  }
  return array;
}

py::array stamps(const Batch& batch) {
  py::array_t<std::int64_t> array(static_cast<py::ssize_t>(batch.X.size()));
  std::transform(batch.X.begin(), batch.X.end(), array.mutable_data(),
                 [](const auto& X) { return X.stamp ? nanoseconds(*X.stamp) : kNoStamp; });
  return array;
}

struct Pair {
  std::string a;
  std::string b;
};

/// One lookup for each pair and instant, of which there are as many, or one for all.
struct Lookups {
  std::vector<Pair> pairs;
  std::vector<std::optional<Time>> instants;
  Query query;

  [[nodiscard]] std::size_t size() const {
    return pairs.empty() || instants.empty() ? 0 : std::max(pairs.size(), instants.size());
  }
  [[nodiscard]] const Pair& pair(std::size_t i) const { return pairs[pairs.size() == 1 ? 0 : i]; }
  [[nodiscard]] Result<StampedTransform> run(Client& client, std::size_t i) const {
    Query at = query;
    at.at = instants[instants.size() == 1 ? 0 : i];
    return client.lookup(pair(i).a, pair(i).b, at);
  }
};

/// Whether this process owns all of the paths: then more threads would only cost.
bool is_own(Client& client, const std::string& partition, const std::vector<Pair>& pairs) {
  return !partition.empty() && std::all_of(pairs.begin(), pairs.end(), [&](const Pair& pair) {
    const auto path = client.path(pair.a, pair.b);
    return !path || std::all_of(path->begin(), path->end(), [&](const PathSegment& segment) {
      return segment.partition == partition;
    });
  });
}

/// Asks others for several at a time, as each takes a round trip.
std::vector<Result<StampedTransform>> run_all(Client& client, const std::string& partition,
                                              const Lookups& lookups) {
  constexpr std::size_t kMostAtOnce = 16;
  std::vector<Result<StampedTransform>> answers(lookups.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < answers.size(); i = next++) {
      answers[i] = lookups.run(client, i);
      if (!answers[i]) next = answers.size();  // the call fails anyway
    }
  };
  const std::size_t at_once =
      is_own(client, partition, lookups.pairs) ? 1 : std::min(kMostAtOnce, answers.size());
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < at_once; ++i) others.push_back(std::async(std::launch::async, work));
  work();
  for (auto& other : others) other.get();
  return answers;
}

std::vector<std::optional<Time>> to_instants(py::handle at) {
  if (at.is_none()) return {std::nullopt};
  const bool many =
      py::isinstance<py::sequence>(at) ||
      (py::isinstance<py::array>(at) && py::reinterpret_borrow<py::array>(at).ndim() > 0);
  if (!many) return {to_time(at)};
  std::vector<std::optional<Time>> instants;
  for (const py::handle one : py::reinterpret_borrow<py::iterable>(at)) {
    instants.push_back(to_stamp(one));
  }
  return instants;
}

Batch lookup_many(const Session& session,
                  const std::vector<std::pair<std::string, std::string>>& pairs, py::handle at,
                  py::handle extrapolate, int order) {
  Lookups lookups;
  for (const auto& pair : pairs) lookups.pairs.push_back({pair.first, pair.second});
  lookups.instants = to_instants(at);
  lookups.query = to_query(py::none(), extrapolate, py::none(), order);
  const std::size_t size = lookups.size();
  if ((lookups.pairs.size() > 1 && lookups.pairs.size() != size) ||
      (lookups.instants.size() > 1 && lookups.instants.size() != size)) {
    throw py::value_error(std::to_string(lookups.pairs.size()) + " pairs, but " +
                          std::to_string(lookups.instants.size()) +
                          " instants: there must be as many, or one of either");
  }
  Batch batch;
  auto answers =
      session.call([&](Client& client) { return run_all(client, session.partition(), lookups); });
  for (auto& answer : answers) {
    if (!answer) raise(answer.error());
  }
  for (auto& answer : answers) batch.X.push_back(*std::move(answer));
  return batch;
}

}  // namespace

std::vector<Transform> to_transforms(py::handle poses, py::handle covariances, std::size_t count) {
  if (is_sequence_of_transforms(poses)) {
    if (!covariances.is_none()) throw py::type_error("Transforms have their covariances already");
    return of_sequence(poses, count);
  }
  const auto rows = static_cast<py::ssize_t>(count);
  const Doubles numbers = doubles(poses, {rows, kPoseNumbers}, "poses");
  const py::array any = py::isinstance<py::str>(covariances) || covariances.is_none()
                            ? py::array()
                            : py::array::ensure(covariances);
  PyErr_Clear();
  const bool each = any && any.ndim() == 3;
  const StatedCovariance common = each ? StatedCovariance() : to_covariance(covariances);
  const Doubles matrices = each ? doubles(covariances, {rows, 6, 6}, "covariances") : Doubles();
  std::vector<Transform> X(count);
  for (std::size_t i = 0; i < count; ++i) {
    X[i].pose = pose_of(numbers.data() + i * kPoseNumbers, i);
    X[i].covariance = common;
    if (!each) continue;
    X[i].covariance =
        of_row(Covariance::from_matrix(to_matrix6(matrices.data() + i * kCovarianceNumbers)), i);
  }
  return X;
}

void bind_batches(py::module_& module, ClientClass& cls) {
  py::class_<Batch>(module, "Batch",
                    "Many transforms as arrays: the answer to lookup_many(). batch[i] is one.")
      .def("__len__", [](const Batch& batch) { return batch.X.size(); })
      .def("__getitem__",
           [](const Batch& batch, py::ssize_t i) {
             const auto size = static_cast<py::ssize_t>(batch.X.size());
             if (i < 0) i += size;
             if (i < 0 || i >= size) throw py::index_error("no such transform");
             return batch.X[static_cast<std::size_t>(i)];
           })
      .def_property_readonly("poses", &poses,
                             "(N, 7): translation [m], then quaternion (x, y, z, w).")
      .def_property_readonly("complete", &Batch::complete,
                             "Whether the covariance of each is complete.")
      .def_property_readonly(
          "covariances",
          [](const Batch& batch) {
            for (const StampedTransform& X : batch.X) {
              if (!X.covariance.complete()) require_complete(py::cast(X));
            }
            return covariances(batch);
          },
          "(N, 6, 6). Raises UnspecifiedCovariance if one is not complete.")
      .def_property_readonly("covariances_of_specified", &covariances,
                             "(N, 6, 6), of those edges that have one.")
      .def_property_readonly("stamps", &stamps,
                             "(N,) int64 [ns]; -1 for those that hold for all times.");
  cls.def(
      "lookup_many", &lookup_many, py::arg("pairs"), py::arg("at") = py::none(), py::kw_only(),
      py::arg("extrapolate") = 0.0, py::arg("order") = 2,
      "Many lookups in one call, those of other partitions several at a time.\n\n"
      "pairs: of ids (a, b). at: None, one instant, or N instants; either one pair and N\n"
      "instants, N pairs and one, or N of both. Otherwise as lookup(); raises the first error.");
}

}  // namespace tfdude::python
