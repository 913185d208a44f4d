#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/types/edge.hpp"

#include "tree/handed_edge.hpp"

// The messages by which a frame goes to another owner.
namespace tfdude {

/// Hands over the frame named by the request's id, and all below it that its owner reaches through
/// own frames, to another partition. If no question follows, that ends.
struct HandOverRequest {
  enum class Step : std::uint8_t {
    kBegin = 1,   ///< from now on the frames do not change
    kRead = 2,    ///< a part of what is known of the frames; changes nothing
    kEnd = 3,     ///< whether the other partition is the owner now: Done, or kNotYet
    kCancel = 4,  ///< the frames stay
  };
  Step step = Step::kBegin;
  std::string to;               ///< the partition that gets the frames
  std::uint32_t edge = 0;       ///< of kRead: the first edge of the part
  std::optional<Time> after{};  ///< of kRead: only the later samples of that edge
};

/// A part of what is known of frames that are handed over: the answer to a HandOverRequest.
struct HandedPart {
  std::uint64_t incarnation = 0;  ///< of their owner
  std::uint32_t first = 0;        ///< the index of the first edge among all
  bool begins = false;            ///< it is the first part
  bool is_last = false;
  /// Parents before children; at most kMostHandedAtOnce, with at most as many samples. The first
  /// may continue the last one of the part before, and the last one may continue.
  std::vector<HandedEdge> edges;
};

inline constexpr std::uint32_t kMostHandedAtOnce = 256;

/// How many samples may be handed over at once.
inline constexpr std::size_t kMostHandedSamples = 65'536;

/// Makes the asked partition the owner of frames of another one, of which the request's id is the
/// top. It gets the parts one after the other, from one sender; with the last one it takes them,
/// in one commit.
struct AdoptRequest {
  std::string from;                     ///< their owner
  std::optional<std::string> parent{};  ///< the new parent of the top; absent: unchanged
  PartialTransform X_PC;                ///< with it: as MoveRequest::X_PC
  HandedPart part;
  std::uint64_t lamport_time = 0;  ///< as LamportTime
};

}  // namespace tfdude
