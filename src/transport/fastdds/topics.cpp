#include "transport/fastdds/topics.hpp"

#include "base/log.hpp"

namespace tfdude::fastdds {

void count_malformed(FastDdsCounters& counters, const char* topic) {
  const std::uint64_t before = counters.malformed.fetch_add(1, std::memory_order_relaxed);
  const std::uint64_t count = before + 1;
  if ((count & before) == 0) {
    log().warn("dropped a malformed DDS sample of topic {} ({} so far on all topics)", topic,
               count);
  }
}

void log_refused(const char* topic, const Error& error) {
  log().warn("rejected a DDS sample of topic {}: {}", topic, error.message);
}

}  // namespace tfdude::fastdds
