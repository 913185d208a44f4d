#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "transport/port.hpp"

// The file that the owner and the publisher of stream_bench both map.
namespace bench {

inline constexpr std::size_t kMostLatencies = 1U << 20U;

struct StreamState {
  std::atomic<int> owner_pid;  // 0: not started yet
  std::atomic<std::uint64_t> applied;
  std::atomic<std::uint64_t> latency_count;
  std::array<double, kMostLatencies> latencies;  // [us], the first latency_count of a run
};

/// Creates or opens the file; its bytes are zero at first. It stays mapped.
StreamState& map_stream_state(const std::string& file);

/// The kind of values that are streamed.
enum class Streamed { kEdges, kJoints };

/// Called after an update has arrived at an owner and was applied.
class AppliedListener {
 public:
  virtual ~AppliedListener() = default;
  virtual void on_applied(Streamed what) = 0;
};

/// Counts the updates that arrive at an owner without changing their way: a transport between the
/// real one and the participant.
tfdude::TransportPtr watch(tfdude::TransportPtr transport, AppliedListener& listener);

}  // namespace bench
