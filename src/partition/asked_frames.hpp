#pragma once

#include <chrono>
#include <string>
#include <unordered_map>
#include <vector>

#include "tfdude/base/result.hpp"

#include "partition/directory.hpp"
#include "partition/messages.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// The frames of a participant that keeps no replica of the structure: those that it has asked
/// others for, each with all above it. An answer is right when it is given, and becomes outdated
/// without notice. So it is only good for requests to owners, which reject what they do not own;
/// everything else needs a fresh one. Not thread-safe.
class AskedFrames {
 public:
  using Steady = std::chrono::steady_clock::time_point;

  /// Writes to the forest, which must not contain frames of other origin.
  AskedFrames(Forest& forest, Directory& directory) : forest_(forest), directory_(directory) {}

  /// Whether a frame is known from an answer that was requested at this time or later. Missing
  /// frames are never known.
  [[nodiscard]] bool knows(const std::string& id, Steady since) const;
  /// Those of the ids that are not.
  [[nodiscard]] std::vector<std::string> lacking(const std::vector<std::string>& ids,
                                                 Steady since) const;

  /// A request whose answer shows all changes that this participant has made.
  [[nodiscard]] FramesRequest request(std::vector<std::string> ids,
                                      std::vector<std::string> trees) const;

  /// @param asked  when the answer was requested
  void take(const FramesRequest& request, const std::vector<KnownFrame>& answer, Steady asked);

  /// The structure has changed: what is known is outdated. Frames and handles stay.
  void outdate() { as_of_.clear(); }

 private:
  void drop(const std::string& id);

  Forest& forest_;
  Directory& directory_;
  std::unordered_map<std::string, Steady> as_of_;  // when a frame was requested last
};

/// Adds to an answer the frames of another one that it does not have, each after its parent.
void merge(std::vector<KnownFrame>& answer, std::vector<KnownFrame>&& other);

/// The answer of a participant that knows all frames. O(answer), plus O(frames) for a prefix. Call
/// it while the structure does not change.
/// @return kNotYet, if a change that the request names has not arrived; kTooMuch
[[nodiscard]] Result<std::vector<KnownFrame>> known_frames(const Forest& forest,
                                                           const Directory& directory,
                                                           const FramesRequest& request);

}  // namespace tfdude
