#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tfdude/types/cloud.hpp"
#include "tfdude/types/many.hpp"

#include "runtime/context.hpp"
#include "runtime/lookups.hpp"
#include "runtime/requests.hpp"
#include "runtime/two_instants.hpp"

namespace tfdude {

/// Lookups of many frames, or at many instants. Client describes the return values.
/// @par Thread safety  All functions are thread-safe.
class ManyLookups {
 public:
  using Found = Result<StampedTransform>;

  ManyLookups(const Context& context, Lookups& lookups, TwoInstants& two_instants)
      : structure_(context.structure),
        discovery_(context.discovery),
        requests_(context.requests),
        timeout_(context.options.timeout),
        lookups_(lookups),
        two_instants_(two_instants) {}

  [[nodiscard]] std::vector<Found> lookup(const std::vector<FramePair>& pairs, const Query& query,
                                          Milliseconds wait);
  [[nodiscard]] Result<Trajectory> trajectory(std::string_view a, std::string_view b,
                                              const std::vector<Time>& instants, const Query& query,
                                              Milliseconds wait);
  /// @tparam Number  double or float
  template <class Number>
  [[nodiscard]] Result<TransformedCloud<Number>> transform_cloud(
      std::string_view a, std::string_view b,
      const Eigen::Ref<const Eigen::Matrix<Number, 3, Eigen::Dynamic>>& points,
      const CloudQuery& query, Milliseconds wait);

 private:
  // The transforms of a cloud, and which of them each point has; none: all have the first.
  struct CloudPoses {
    std::vector<Transform> X_AB;
    std::vector<std::uint32_t> of_point;
    Basis basis;
    bool complete = true;
  };

  [[nodiscard]] std::vector<Found> lookup_once(const std::vector<FramePair>& pairs,
                                               const Query& query, const Deadline& deadline);
  [[nodiscard]] Result<CloudPoses> poses_of(std::string_view a, std::string_view b,
                                            const CloudQuery& query, Milliseconds wait);
  [[nodiscard]] Result<CloudPoses> over_fixed(std::string_view a, std::string_view b,
                                              const CloudQuery& query,
                                              const std::vector<Time>& instants);
  /// @return also kChangedMeanwhile
  [[nodiscard]] Result<CloudPoses> poses_over_fixed(std::string_view a, std::string_view b,
                                                    const CloudQuery& query, const Query& at_a,
                                                    const std::vector<Time>& instants);
  [[nodiscard]] Result<Trajectory> trajectory_once(std::string_view a, std::string_view b,
                                                   const std::vector<Time>& instants,
                                                   const Query& query);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  const Milliseconds timeout_;
  Lookups& lookups_;
  TwoInstants& two_instants_;
  SharedHints hints_;
};

}  // namespace tfdude
