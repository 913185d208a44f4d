#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tfdude/types/frame.hpp"

#include "runtime/context.hpp"
#include "runtime/member_runner.hpp"

namespace tfdude {

/// Makes a participant the owner of its partition: claims the name, loads the state of an earlier
/// process and the configuration, and announces the result. Not thread-safe.
class Serving {
 public:
  explicit Serving(const Context& context)
      : structure_(context.structure),
        discovery_(context.discovery),
        transport_(context.transport),
        member_(context.member),
        options_(context.options) {}

  /// @return kPartitionTaken, kState; the error of the first invalid frame
  [[nodiscard]] Result<void> serve(const std::vector<FrameSpec>& frames);

 private:
  [[nodiscard]] Result<void> claim_name();
  [[nodiscard]] Result<StoredState> open_store(std::unique_ptr<StateStore>& store);
  [[nodiscard]] Result<void> take_frames(const std::vector<FrameSpec>& frames);
  void limit_history();
  /// @param left_static  as left_static()
  [[nodiscard]] Result<void> set_timings(const std::vector<FrameSpec>& frames,
                                         const std::set<std::string>& left_static);
  void await_gone();

  Structure& structure_;
  Discovery& discovery_;
  Transport& transport_;
  MemberRunner& member_;
  const ParticipantOptions& options_;
};

}  // namespace tfdude
