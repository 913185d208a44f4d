#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "tfdude/transport/transport.hpp"

namespace tfdude {

/// What came to a participant's readers of requests and updates, before and after the filters; what never
/// came to them woke nobody.
struct FastDdsCounters {
  std::atomic<std::uint64_t> requests_arrived{0};
  std::atomic<std::uint64_t> requests_passed{0};
  std::atomic<std::uint64_t> updates_arrived{0};
  std::atomic<std::uint64_t> updates_passed{0};
  std::atomic<std::uint64_t> malformed{0};  ///< dropped: not well formed
};

struct FastDdsOptions {
  std::uint32_t domain = 0;  ///< 0 to 232
  std::string profile;       ///< XML file; profiles that it lacks are taken from the built-in ones
  std::string partition;     ///< the one that the participant is going to serve; empty: none
  std::shared_ptr<FastDdsCounters> counters;  ///< counted into, where given
};

/// A participant's access to a DDS domain by Fast DDS. Switches Fast DDS's delivery inside a process off for
/// the whole process, since it calls handlers under the library's locks, and sends its log to standard
/// error.
/// @return kInvalidInput (domain). start() may fail with kConfig (profile) and kTransport.
[[nodiscard]] Result<std::unique_ptr<Transport>> make_fastdds_transport(
    const FastDdsOptions& options);

}  // namespace tfdude
