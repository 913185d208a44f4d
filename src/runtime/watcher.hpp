#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "base/mutex.hpp"
#include "runtime/discovery.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"
#include "runtime/watches.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// The watcher's side of what owners push: plans watched paths by the structure, and hands them what comes.
/// @par Thread safety  All functions.
class Watcher {
 public:
  /// @param incarnation  of the own partition's process
  /// @param timeout  within which all owners of a path are to answer
  Watcher(Structure& structure, Discovery& discovery, Requests& requests, Transport& transport,
          std::function<std::uint64_t()> incarnation, Milliseconds timeout)
      : structure_(structure),
        discovery_(discovery),
        requests_(requests),
        transport_(transport),
        incarnation_(std::move(incarnation)),
        timeout_(timeout) {}

  /// The paths get nothing new from now on. By one thread, after which nobody calls watch().
  void stop();

  /// @return as Client::watch
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> watch(const std::string& a,
                                                           const std::string& b,
                                                           const WatchOptions& options);

  /// What was pushed. @return whether anybody here watches
  bool on_pushed(const PushedValues& pushed);

  /// Whether a path that is watched could be looked up so from what has been pushed.
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const;

  /// The structure has changed, or who is there.
  void look_again();

 private:
  [[nodiscard]] Watches& watches();
  [[nodiscard]] Result<WatchRoute> plan(const WatchedPath& path);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  Transport& transport_;
  const std::function<std::uint64_t()> incarnation_;
  const Milliseconds timeout_;
  Mutex mutex_;                                                 // of watches_, as it is made
  std::unique_ptr<Watches> watches_ TFDUDE_GUARDED_BY(mutex_);  // once this process watches
  std::atomic<Watches*> watching_{nullptr};
};

}  // namespace tfdude
