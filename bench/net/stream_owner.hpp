#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "transport/port.hpp"

// What the owner and the publisher of stream_bench share: a file that both map.
namespace bench {

inline constexpr std::size_t kMostLatencies = 1U << 20U;

struct StreamState {
  std::atomic<int> owner_pid;  // 0: not there yet
  std::atomic<std::uint64_t> applied;
  std::atomic<std::uint64_t> latency_count;
  std::array<double, kMostLatencies> latencies;  // [us], the first latency_count of a run
};

/// Made or opened; zero at first. Stays mapped.
StreamState& map_stream_state(const std::string& file);

/// What is streamed.
enum class Streamed { kEdges, kJoints };

/// Called after each update that has come to an owner, when it has been applied.
class AppliedListener {
 public:
  virtual ~AppliedListener() = default;
  virtual void on_applied(Streamed what) = 0;
};

/// Counts what comes to an owner without changing how it gets there: a transport between the real
/// one and the participant.
tfdude::TransportPtr watch(tfdude::TransportPtr transport, AppliedListener& listener);

}  // namespace bench
