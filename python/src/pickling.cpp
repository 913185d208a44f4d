#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "tfdude/math/earth.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/explanation.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/partition_info.hpp"
#include "tfdude/types/query.hpp"

#include "bind.hpp"
#include "possible.hpp"

// Values in pickles, with all digits; copy and deepcopy use the same. A struct is the tuple of its
// members.
namespace tfdude::python {
namespace {

/// The members of a struct.
template <class T>
struct Members;

#define TFDUDE_MEMBERS(type, ...)                              \
  template <>                                                  \
  struct Members<type> {                                       \
    static constexpr auto kAll = std::make_tuple(__VA_ARGS__); \
  }

TFDUDE_MEMBERS(Transform, &Transform::pose, &Transform::covariance);
TFDUDE_MEMBERS(LostOwner, &LostOwner::partition, &LostOwner::ago);
TFDUDE_MEMBERS(Basis, &Basis::order, &Basis::bound, &Basis::sources, &Basis::unspecified,
               &Basis::lost);
TFDUDE_MEMBERS(StampedTransform, &StampedTransform::pose, &StampedTransform::covariance,
               &StampedTransform::stamp, &StampedTransform::basis);
TFDUDE_MEMBERS(Velocity, &Velocity::linear, &Velocity::angular, &Velocity::covariance,
               &Velocity::begin, &Velocity::end, &Velocity::basis);
TFDUDE_MEMBERS(Geodetic, &Geodetic::latitude, &Geodetic::longitude, &Geodetic::altitude);
TFDUDE_MEMBERS(Utm, &Utm::zone, &Utm::north, &Utm::easting, &Utm::northing, &Utm::altitude,
               &Utm::convergence, &Utm::scale);
TFDUDE_MEMBERS(GeodeticPose, &GeodeticPose::place, &GeodeticPose::utm, &GeodeticPose::X_NB);
TFDUDE_MEMBERS(Frame, &Frame::id, &Frame::parent, &Frame::partition, &Frame::attached);
TFDUDE_MEMBERS(PathSegment, &PathSegment::partition, &PathSegment::from, &PathSegment::to,
               &PathSegment::clock);
TFDUDE_MEMBERS(ProtocolVersion, &ProtocolVersion::major, &ProtocolVersion::minor);
TFDUDE_MEMBERS(PartitionInfo, &PartitionInfo::name, &PartitionInfo::host, &PartitionInfo::pid,
               &PartitionInfo::frames, &PartitionInfo::reachable, &PartitionInfo::since,
               &PartitionInfo::stopped, &PartitionInfo::program, &PartitionInfo::protocol,
               &PartitionInfo::clock, &PartitionInfo::in_memory, &PartitionInfo::why_not_in_memory,
               &PartitionInfo::silent, &PartitionInfo::complete);
TFDUDE_MEMBERS(Change, &Change::kind, &Change::partition, &Change::frame, &Change::parent,
               &Change::rival, &Change::message, &Change::time, &Change::stopped, &Change::joint);
TFDUDE_MEMBERS(HistoryInfo, &HistoryInfo::id, &HistoryInfo::samples, &HistoryInfo::bytes,
               &HistoryInfo::span_limit, &HistoryInfo::count_limit, &HistoryInfo::oldest,
               &HistoryInfo::newest, &HistoryInfo::mean_gap, &HistoryInfo::max_gap,
               &HistoryInfo::jitter, &HistoryInfo::refused_old, &HistoryInfo::refused_equal,
               &HistoryInfo::refused_ahead);
TFDUDE_MEMBERS(NormalizedInnovation, &NormalizedInnovation::squares,
               &NormalizedInnovation::expected, &NormalizedInnovation::variance);
TFDUDE_MEMBERS(EdgeConsistency, &EdgeConsistency::id, &EdgeConsistency::observations,
               &EdgeConsistency::refused, &EdgeConsistency::sum);
TFDUDE_MEMBERS(Observed, &Observed::distance_squared, &Observed::dimensions, &Observed::limit,
               &Observed::accepted, &Observed::corrected, &Observed::forgotten, &Observed::stamp);
TFDUDE_MEMBERS(JointLimits, &JointLimits::lower, &JointLimits::upper);
TFDUDE_MEMBERS(Mimic, &Mimic::joint, &Mimic::multiplier, &Mimic::offset, &Mimic::of_continuous);
TFDUDE_MEMBERS(Joint, &Joint::X_PJ, &Joint::S);
TFDUDE_MEMBERS(JointSpec, &JointSpec::name, &JointSpec::type, &JointSpec::joint, &JointSpec::limits,
               &JointSpec::mimic, &JointSpec::coupled, &JointSpec::strict, &JointSpec::position,
               &JointSpec::variance, &JointSpec::sample_variance);
TFDUDE_MEMBERS(JointInfo, &JointInfo::name, &JointInfo::frame, &JointInfo::type, &JointInfo::limits,
               &JointInfo::mimic, &JointInfo::position, &JointInfo::variance, &JointInfo::measured,
               &JointInfo::outside, &JointInfo::refused);
TFDUDE_MEMBERS(EdgeTiming, &EdgeTiming::span, &EdgeTiming::count, &EdgeTiming::process_noise,
               &EdgeTiming::drifts, &EdgeTiming::moving, &EdgeTiming::max_ahead,
               &EdgeTiming::restart_after, &EdgeTiming::believed);
TFDUDE_MEMBERS(CommonError, &CommonError::source, &CommonError::subtracts, &CommonError::loading);
TFDUDE_MEMBERS(Correlation, &Correlation::unknown, &Correlation::common_errors,
               &Correlation::observed_with);
TFDUDE_MEMBERS(FrameSpec, &FrameSpec::id, &FrameSpec::parent, &FrameSpec::X_PC, &FrameSpec::timing,
               &FrameSpec::correlation, &FrameSpec::joint);
TFDUDE_MEMBERS(Interval, &Interval::from, &Interval::until);
TFDUDE_MEMBERS(Error, &Error::code, &Error::message, &Error::frame, &Error::partition,
               &Error::available);
TFDUDE_MEMBERS(Possible, &Possible::why_not);
TFDUDE_MEMBERS(Cause, &Cause::obstacle, &Cause::frame, &Cause::partition, &Cause::since,
               &Cause::needs, &Cause::similar, &Cause::clock_ahead, &Cause::error);
TFDUDE_MEMBERS(VarianceShare, &VarianceShare::name, &VarianceShare::variance,
               &VarianceShare::share);
TFDUDE_MEMBERS(PossibleMeasurement, &PossibleMeasurement::a, &PossibleMeasurement::b,
               &PossibleMeasurement::variance_after);
TFDUDE_MEMBERS(OwnerAge, &OwnerAge::partition, &OwnerAge::reachable, &OwnerAge::slowest,
               &OwnerAge::newest, &OwnerAge::age, &OwnerAge::clock_ahead);
TFDUDE_MEMBERS(Explanation, &Explanation::X_AB, &Explanation::cause, &Explanation::direction,
               &Explanation::is_rotation, &Explanation::variance, &Explanation::edges,
               &Explanation::sources, &Explanation::joints, &Explanation::best,
               &Explanation::assumed_joints, &Explanation::owners);

#undef TFDUDE_MEMBERS

[[noreturn]] void other_version() {
  throw py::value_error("this was not pickled by this version of tfdude");
}

py::tuple tuple_of(py::handle state, std::size_t size) {
  if (!py::isinstance<py::tuple>(state)) other_version();
  auto all = py::reinterpret_borrow<py::tuple>(state);
  if (all.size() != size) other_version();
  return all;
}

template <class T>
py::object saved(const T& value);
template <class T>
T loaded(py::handle state);

/// How a type is stored that is no struct of Members.
template <class T, class = void>
struct Stored {
  static py::object save(const T& value) {
    return std::apply(
        [&](auto... member) { return py::object(py::make_tuple(saved(value.*member)...)); },
        Members<T>::kAll);
  }
  static T load(py::handle state) {
    return std::apply(
        [&](auto... member) {
          const py::tuple all = tuple_of(state, sizeof...(member));
          T value{};
          std::size_t i = 0;
          ((value.*member = loaded<std::decay_t<decltype(value.*member)>>(all[i++])), ...);
          return value;
        },
        Members<T>::kAll);
  }
};

template <class T>
struct Stored<T, std::enable_if_t<std::is_arithmetic_v<T> || std::is_same_v<T, std::string>>> {
  static py::object save(const T& value) { return py::cast(value); }
  static T load(py::handle state) { return state.cast<T>(); }
};

template <class T>
struct Stored<T, std::enable_if_t<std::is_enum_v<T>>> {
  static py::object save(T value) { return py::int_(static_cast<int>(value)); }
  static T load(py::handle state) { return static_cast<T>(state.cast<int>()); }
};

template <>
struct Stored<std::chrono::nanoseconds> {
  static py::object save(std::chrono::nanoseconds value) { return py::int_(value.count()); }
  static std::chrono::nanoseconds load(py::handle state) {
    return std::chrono::nanoseconds(state.cast<std::int64_t>());
  }
};

template <>
struct Stored<Time> {
  static py::object save(Time value) { return py::int_(nanoseconds(value)); }
  static Time load(py::handle state) { return time_of(state.cast<std::int64_t>()); }
};

template <class T>
struct Stored<std::optional<T>> {
  static py::object save(const std::optional<T>& value) {
    return value ? saved(*value) : py::object(py::none());
  }
  static std::optional<T> load(py::handle state) {
    return state.is_none() ? std::nullopt : std::optional<T>(loaded<T>(state));
  }
};

template <class T>
struct Stored<std::vector<T>> {
  static py::object save(const std::vector<T>& values) {
    py::list all;
    for (const T& value : values) all.append(saved(value));
    return all;
  }
  static std::vector<T> load(py::handle state) {
    std::vector<T> values;
    for (const py::handle one : state.cast<py::list>()) values.push_back(loaded<T>(one));
    return values;
  }
};

/// Matrices of Eigen, column by column.
template <int kRows, int kColumns>
struct Stored<Eigen::Matrix<double, kRows, kColumns>> {
  using Matrix = Eigen::Matrix<double, kRows, kColumns>;
  static py::object save(const Matrix& matrix) {
    return saved(std::vector<double>(matrix.data(), matrix.data() + matrix.size()));
  }
  static Matrix load(py::handle state) {
    const auto numbers = loaded<std::vector<double>>(state);
    const auto size = static_cast<Eigen::Index>(numbers.size());
    if (size % kRows != 0 || (kColumns != Eigen::Dynamic && size != kRows * kColumns)) {
      other_version();
    }
    return Eigen::Map<const Matrix>(numbers.data(), kRows, size / kRows);
  }
};

/// What create() would normalize again keeps its digits.
template <>
struct Stored<Pose> {
  static py::object save(const Pose& pose) {
    const Eigen::Matrix<double, 4, 1> q = pose.rotation().coeffs();
    return py::make_tuple(saved(q), saved(pose.translation()));
  }
  static Pose load(py::handle state) {
    const py::tuple both = tuple_of(state, 2);
    const Eigen::Quaterniond q(loaded<Eigen::Matrix<double, 4, 1>>(both[0]));
    const auto p = loaded<Eigen::Vector3d>(both[1]);
    constexpr double kRounding = 1e-12;
    const Pose checked = value_of(Pose::create(q, p));
    return std::abs(q.norm() - 1) < kRounding ? Pose::trusted(q, p) : checked;
  }
};

template <>
struct Stored<Covariance> {
  static py::object save(const Covariance& sigma) {
    return saved(std::vector<double>(sigma.upper().begin(), sigma.upper().end()));
  }
  static Covariance load(py::handle state) {
    const auto numbers = loaded<std::vector<double>>(state);
    Covariance::Upper upper{};
    if (numbers.size() != upper.size()) other_version();
    std::copy(numbers.begin(), numbers.end(), upper.begin());
    (void)value_of(Covariance::from_upper(upper));
    return Covariance::trusted(upper);
  }
};

template <>
struct Stored<StatedCovariance> {
  static py::object save(const StatedCovariance& stated) {
    return py::make_tuple(saved(stated.of_specified()), stated.complete());
  }
  static StatedCovariance load(py::handle state) {
    const py::tuple both = tuple_of(state, 2);
    const auto sigma = loaded<Covariance>(both[0]);
    return both[1].cast<bool>() ? StatedCovariance(sigma) : StatedCovariance::incomplete(sigma);
  }
};

template <class T>
py::object saved(const T& value) {
  return Stored<T>::save(value);
}

template <class T>
T loaded(py::handle state) {
  return Stored<T>::load(state);
}

template <class T>
void add_to(const py::module_& module, const char* name) {
  auto cls = py::reinterpret_borrow<py::class_<T>>(module.attr(name));
  cls.def(py::pickle([](const T& value) { return py::tuple(saved(value)); },
                     [](const py::tuple& state) { return loaded<T>(state); }));
}

}  // namespace

void bind_pickling(py::module_& module) {
  add_to<Transform>(module, "Transform");
  add_to<StampedTransform>(module, "StampedTransform");
  add_to<Velocity>(module, "Velocity");
  add_to<Geodetic>(module, "Geodetic");
  add_to<Utm>(module, "Utm");
  add_to<GeodeticPose>(module, "GeodeticPose");
  add_to<Frame>(module, "Frame");
  add_to<PathSegment>(module, "PathSegment");
  add_to<PartitionInfo>(module, "PartitionInfo");
  add_to<Change>(module, "Change");
  add_to<HistoryInfo>(module, "HistoryInfo");
  add_to<EdgeConsistency>(module, "EdgeConsistency");
  add_to<Observed>(module, "Observed");
  add_to<Possible>(module, "Possible");
  add_to<Cause>(module, "Cause");
  add_to<Explanation>(module, "Explanation");
  add_to<JointSpec>(module, "Joint");
  add_to<JointInfo>(module, "JointInfo");
  add_to<FrameSpec>(module, "FrameSpec");
}

}  // namespace tfdude::python
