#include "math/climb.hpp"

#include <type_traits>

#include "math/columns.hpp"

namespace tfdude {

// What the kernel takes an edge for: quaternion, translation, upper triangle.
static_assert(std::is_standard_layout_v<Pose> && sizeof(Pose) == 7 * sizeof(double));
static_assert(std::is_standard_layout_v<Transform> && sizeof(Transform) == 28 * sizeof(double));

template <class Value>
void Climb<Value>::compute() {
  if constexpr (std::is_same_v<Value, Transform>) {
    kernel::functions().climb_with_covariance(X_SH_, left_, pending_.data(), count_);
  } else {
    kernel::functions().climb(X_SH_, pending_.data(), count_);
  }
  count_ = 0;
}

template <class Value>
Value join(Climb<Value>&& from_a, Climb<Value>&& from_b) {
  from_a.compute();
  from_b.compute();
  const kernel::Functions& compute = kernel::functions();
  const Pose X_AB = kernel::pose_of(compute.quotient(from_a.X_SH_, from_b.X_SH_));
  if constexpr (std::is_same_v<Value, Transform>) {
    const kernel::Columns X_BA = compute.quotient(from_b.X_SH_, from_a.X_SH_);
    compute.add_transported(X_BA, kernel::upper_of(from_a.left_).data(), from_b.left_);
    return {X_AB, Covariance::trusted(kernel::upper_of(from_b.left_))};
  } else {
    return X_AB;
  }
}

template class Climb<Transform>;
template class Climb<Pose>;
template Transform join(Climb<Transform>&&, Climb<Transform>&&);
template Pose join(Climb<Pose>&&, Climb<Pose>&&);

}  // namespace tfdude
