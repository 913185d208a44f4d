#include "memory/one_shot.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <unistd.h>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/bytes.hpp"

namespace tfdude {
namespace {

// They change with what the messages mean.
constexpr std::uint64_t kQuestion = 0x3151'48535F464454;
constexpr std::uint64_t kAnswer = 0x3141'48535F464454;

constexpr std::uint8_t kNoClock = 0xFF;

void put_time(ByteWriter& out, const std::optional<Time>& time) {
  out.u8(time ? 1 : 0);
  out.u64(time ? static_cast<std::uint64_t>(nanoseconds(*time)) : 0);
}

std::optional<Time> take_time(ByteReader& in) {
  const bool there = in.u8() != 0;
  const Time time{std::chrono::nanoseconds(static_cast<std::int64_t>(in.u64()))};
  return there ? std::optional<Time>(time) : std::nullopt;
}

bool take_id(ByteReader& in, std::string& id) {
  id = in.text();
  return in.good() && check_id(id, "id");
}

void put_names(ByteWriter& out, const std::vector<std::string>& names) {
  out.u32(static_cast<std::uint32_t>(names.size()));
  for (const std::string& name : names) out.text(name);
}

// Each takes five bytes at least, so their number is bounded by the message.
bool take_names(ByteReader& in, std::vector<std::string>& names) {
  for (std::uint32_t left = in.u32(); left > 0; --left) {
    if (!take_id(in, names.emplace_back())) return false;
  }
  return in.good();
}

template <std::size_t kCount>
bool take_numbers(ByteReader& in, std::array<double, kCount>& numbers) {
  bool finite = true;
  for (double& number : numbers) {
    number = in.f64();
    finite = finite && std::isfinite(number);
  }
  return finite && in.good();
}

void put_transform(ByteWriter& out, const Transform& X) {
  const Eigen::Vector4d q = X.pose.rotation().coeffs();
  const Eigen::Vector3d p = X.pose.translation();
  for (const double number : {q[0], q[1], q[2], q[3], p[0], p[1], p[2]}) out.f64(number);
  for (const double number : X.covariance.of_specified().upper()) out.f64(number);
  out.u8(X.covariance.complete() ? 1 : 0);
}

// The pose is not normalized again: the answer has the same bits as the lookup.
bool take_transform(ByteReader& in, Transform& X) {
  std::array<double, 7> pose{};
  Covariance::Upper upper{};
  if (!take_numbers(in, pose) || !take_numbers(in, upper)) return false;
  const Eigen::Quaterniond q(pose[3], pose[0], pose[1], pose[2]);
  const Eigen::Vector3d p(pose[4], pose[5], pose[6]);
  constexpr double kRounding = 1e-9;
  if (std::abs(q.squaredNorm() - 1) > kRounding) return false;
  X = {Pose::trusted(q, p), StatedCovariance::trusted(upper, in.u8() != 0)};
  return in.good();
}

}  // namespace

std::string one_shot_message(const OneShotQuestion& question) {
  std::string message;
  ByteWriter out(message);
  out.u64(kQuestion);
  out.text(question.a);
  out.text(question.b);
  put_time(out, question.at);
  return message;
}

std::optional<OneShotQuestion> one_shot_question(std::string_view message) {
  ByteReader in(message);
  OneShotQuestion question;
  if (in.u64() != kQuestion || !take_id(in, question.a) || !take_id(in, question.b)) return {};
  question.at = take_time(in);
  if (!in.good() || in.left() != 0) return {};
  return question;
}

std::string one_shot_message(const OneShotAnswer& answer) {
  std::string message;
  ByteWriter out(message);
  out.u64(kAnswer);
  put_transform(out, answer.X_AB);
  put_time(out, answer.X_AB.stamp);
  put_names(out, answer.X_AB.basis.sources);
  put_names(out, answer.X_AB.basis.unspecified);
  out.u32(static_cast<std::uint32_t>(answer.path.size()));
  for (const PathSegment& segment : answer.path) {
    out.text(segment.partition);
    out.text(segment.from);
    out.text(segment.to);
    out.u8(segment.clock ? static_cast<std::uint8_t>(*segment.clock) : kNoClock);
  }
  return message;
}

std::optional<OneShotAnswer> one_shot_answer(std::string_view message) {
  ByteReader in(message);
  OneShotAnswer answer;
  StampedTransform& X_AB = answer.X_AB;
  if (in.u64() != kAnswer || !take_transform(in, X_AB)) return {};
  X_AB.stamp = take_time(in);
  if (!take_names(in, X_AB.basis.sources) || !take_names(in, X_AB.basis.unspecified)) return {};
  for (std::uint32_t left = in.u32(); left > 0; --left) {
    PathSegment& segment = answer.path.emplace_back();
    const bool named =
        take_id(in, segment.partition) && take_id(in, segment.from) && take_id(in, segment.to);
    if (!named) return {};
    const std::uint8_t clock = in.u8();
    if (clock == kNoClock) continue;
    if (clock > static_cast<std::uint8_t>(ClockKind::kExternal)) return {};
    segment.clock = static_cast<ClockKind>(clock);
  }
  if (!in.good() || in.left() != 0) return {};
  return answer;
}

std::string one_shot_name(const std::string& network, int number) {
  return "tfdude-asked-" + std::to_string(geteuid()) + "-" + network + "-" + std::to_string(number);
}

}  // namespace tfdude
