#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "calls/call.hpp"
#include "partition/asked_frames.hpp"
#include "partition/routing.hpp"
#include "runtime/deadline.hpp"
#include "runtime/discovery.hpp"
#include "runtime/structure.hpp"

namespace tfdude {

/// Asks owners for the frames that this participant needs, and does not keep
/// (ClientOptions::follow). Each owner knows all frames, so any of them may answer; but one that
/// has started after another was lost does not know the frames of that. So what is missing is asked
/// of all.
/// @par Thread safety  All functions are thread-safe, for callers that hold no lock.
class OnDemand {
 public:
  using Clock = Deadline::Clock;

  struct Links {
    /// @return a reply for each part
    std::function<std::vector<Reply>(std::vector<Part>&, const Deadline&)> ask;
    /// Frames have appeared, disappeared or moved, as far as they are known here.
    std::function<void()> on_routes;
  };

  /// @param follow  as ClientOptions::follow
  OnDemand(Structure& structure, Discovery& discovery, std::vector<std::string> follow,
           Links links);

  /// Asks for those of the frames that are not known well enough. Afterwards the forest shows them
  /// as the answer did; that some do not exist is not an error.
  /// @param max_age  as Task::max_age()
  /// @return whether it has just asked for all of them; also kTimeout, kUnreachable, kUnsupported,
  ///   kNotPermitted
  [[nodiscard]] Result<bool> know(const std::vector<std::string>& ids, Milliseconds max_age,
                                  const Deadline& deadline);

  /// All frames that are followed, and those above them, as of now. @return as know(); kTooMuch
  [[nodiscard]] Result<std::vector<KnownFrame>> followed(const Deadline& deadline);

  /// The structure has changed.
  void outdate();

 private:
  [[nodiscard]] Result<std::vector<KnownFrame>> ask(const FramesRequest& request,
                                                    const Deadline& deadline);
  [[nodiscard]] Result<std::vector<KnownFrame>> ask_one(Owner owner, const FramesRequest& request,
                                                        const Deadline& deadline);
  /// What all others know.
  [[nodiscard]] std::vector<KnownFrame> ask_others(Owner asked, const FramesRequest& request,
                                                   const Deadline& deadline);
  /// Whether others may know more than this answer.
  [[nodiscard]] bool may_lack(const FramesRequest& request, const std::vector<KnownFrame>& answer,
                              const Deadline& deadline);
  [[nodiscard]] Result<std::vector<KnownFrame>> nobody(const FramesRequest& request);
  void take(const FramesRequest& request, const std::vector<KnownFrame>& answer,
            Clock::time_point asked);
  void await_owners(const std::vector<KnownFrame>& answer, const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  const std::vector<std::string> follow_;
  const Links links_;
  AskedFrames asked_ TFDUDE_GUARDED_BY(structure_.mutex);
  bool follows_ TFDUDE_GUARDED_BY(structure_.mutex) = false;  // what it follows was asked for once
};

}  // namespace tfdude
