#include "tree/sample_store.hpp"

#include <cstring>

namespace tfdude {
namespace {

// Bit by bit, so zeros of two signs count as different. Takes a third of the time of memcmp().
template <class T>
bool same(const T& a, const T& b) {
  using Pair = std::uint64_t __attribute__((vector_size(16)));
  constexpr std::size_t kPairs = sizeof(T) / sizeof(Pair);
  static_assert(sizeof(T) == kPairs * sizeof(Pair));
  const auto pair = [](const T& of, std::size_t i) {
    Pair copy;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): only its bytes
    std::memcpy(&copy, reinterpret_cast<const char*>(&of) + i * sizeof(Pair), sizeof(Pair));
    return copy;
  };
  // Those that differ mostly differ here.
  Pair differences[4] = {pair(a, 0) ^ pair(b, 0)};
  if ((differences[0][0] | differences[0][1]) != 0) return false;
  for (std::size_t i = 1; i < kPairs; ++i) differences[i % 4] |= pair(a, i) ^ pair(b, i);
  const Pair any = (differences[0] | differences[1]) | (differences[2] | differences[3]);
  return (any[0] | any[1]) == 0;
}

bool is_shared(const GivenValue& value, const SharedPart& part) {
  if (part.is_joint != (value.state != nullptr)) return false;
  if (!part.is_joint) {
    const auto& of_part = static_cast<const SharedCovariance&>(part);
    const bool revised = value.revision != nullptr || part.is_revised;
    return !revised && same(value.X_PC.covariance, of_part.covariance);
  }
  const Joint& joint = *value.state->joint;
  const PreparedJoint& prepared = static_cast<const SharedJoint&>(part).joint;
  const Joint& of_part = prepared.joint();
  const Pose& X = joint.X_PJ.pose;
  const Pose& Y = of_part.X_PJ.pose;
  return value.state->period == prepared.period() && joint.S == of_part.S &&
         X.translation() == Y.translation() && X.rotation().coeffs() == Y.rotation().coeffs() &&
         same(joint.X_PJ.covariance, of_part.X_PJ.covariance);
}

}  // namespace

const SharedPart* SampleStore::share(const GivenValue& value, const SharedPart* neighbour,
                                     const SharedPart* other) {
  const SharedPart* part = nullptr;
  if (neighbour != nullptr && is_shared(value, *neighbour)) {
    part = neighbour;
  } else if (other != nullptr && is_shared(value, *other)) {
    part = other;
  } else {
    part = fresh_part(value);
  }
  ++of_writer(part).samples;
  return part;
}

const SharedPart* SampleStore::fresh_part(const GivenValue& value) {
  if (value.state == nullptr) {
    SharedCovariance* part = covariances_.take();
    part->covariance = value.X_PC.covariance;
    part->is_revised = value.revision != nullptr;
    part->is_given = !part->is_revised;
    part->set_revision(part->is_revised ? make_in<const SharedRevision>(arena_, *value.revision)
                                        : nullptr);
    bytes_ += bytes_of(*part);
    return part;
  }
  SharedJoint* part = joints_.take();
  part->is_joint = true;
  part->is_given = false;
  part->joint = PreparedJoint(*value.state->joint, value.state->period);
  bytes_ += sizeof(*part);
  return part;
}

void SampleStore::supersede(const SharedPart* shared) {
  bytes_ -= bytes_of(*shared);
  SharedPart& part = of_writer(shared);
  if (part.is_joint) {
    joints_.supersede(&static_cast<SharedJoint&>(part));
  } else {
    covariances_.supersede(&static_cast<SharedCovariance&>(part));
  }
}

}  // namespace tfdude
