#pragma once

#include <exception>
#include <functional>
#include <string>
#include <type_traits>

#include "tfdude/base/result.hpp"

#include "base/mutex.hpp"

// The creation of DDS entities, which may fail: the library then returns null.
namespace tfdude::fastdds {

/// Whether a creation fails, as for a test; it may also throw. @param what  as in the error
using FailCreation = std::function<bool(const std::string& what)>;

/// From now on creations fail for which this returns true; null: none but those that do. For tests.
void fail_creations(FailCreation fails);

[[nodiscard]] bool creation_fails(const std::string& what);

[[nodiscard]] tl::unexpected<Error> not_created(const std::string& what);

/// Whether the system has as many threads left as a participant may need. Of those that Fast DDS
/// does not get, it returns an error for some, and ends the process for others: it joins threads
/// that never began. Begins and ends that many. @return kTransport
[[nodiscard]] Result<void> threads_to_spare();

/// Logs what does not happen because of that, the 1st, 2nd, 4th, 8th... time.
void log_not_created(const char* consequence, const Error& error);

/// Hold it while an endpoint is created or deleted, and never in a callback of Fast DDS. All
/// endpoints of a topic in a process share a pool of memory. Who creates one looks whether the pool
/// is there, and only then takes hold of it (2.9's TopicPayloadPoolRegistry). If the last endpoint
/// is deleted between the two, Fast DDS follows a null pointer.
[[nodiscard]] Mutex& endpoints_change();

/// All entities are created through this. Fast DDS returns null, or throws: it then had no thread,
/// descriptor or memory. @return kTransport, with what could not be created
template <class Create>
[[nodiscard]] Result<std::invoke_result_t<Create>> created(const std::string& what, Create create) {
  try {
    auto* entity = creation_fails(what) ? nullptr : create();
    if (entity == nullptr) return not_created(what);
    return entity;
  } catch (const std::exception& error) {
    return not_created(what + ": " + error.what());
  }
}

}  // namespace tfdude::fastdds
