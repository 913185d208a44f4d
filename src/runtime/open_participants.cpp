#include "runtime/open_participants.hpp"

#include <cstdlib>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <unistd.h>

#include "base/acting_thread.hpp"
#include "base/log.hpp"
#include "runtime/participant.hpp"

namespace tfdude {
namespace {

struct OpenParticipants {
  std::mutex mutex;
  std::set<Participant*> all;
  pid_t process = 0;  // whose they are
  int registered = 0;
};

// Never destroyed: participants may end after all else.
OpenParticipants& open_participants() {
  static auto* const known = new OpenParticipants;
  return *known;
}

Participant* taken(OpenParticipants& known) {
  const std::lock_guard<std::mutex> lock(known.mutex);
  return known.all.empty() ? nullptr : known.all.extract(known.all.begin()).value();
}

void end_all() {
  OpenParticipants& known = open_participants();
  {
    const std::lock_guard<std::mutex> lock(known.mutex);
    if (known.all.empty() || known.process != getpid()) return;
  }
  // By a thread whose own variables are not destroyed yet, as those of this one may be.
  try {
    std::thread([&known, exiting = std::this_thread::get_id()] {
      act_for(exiting);
      // Without the lock: it waits for functions of the program, which may open or end others.
      while (Participant* const participant = taken(known)) participant->end();
    }).join();
  } catch (const std::system_error&) {
    // Without another thread, what is open goes on until the process is gone.
  }
}

// What was made before it was registered is destroyed after it has run: a later participant may be
// the first that needs Fast DDS, or keys. It cannot be registered for each of any number.
constexpr int kMostRegistered = 64;

}  // namespace

void note_open(Participant& participant) {
  (void)log();
  OpenParticipants& known = open_participants();
  const std::lock_guard<std::mutex> lock(known.mutex);
  if (known.all.empty()) known.process = getpid();
  known.all.insert(&participant);
  if (known.registered < kMostRegistered && std::atexit(&end_all) == 0) ++known.registered;
}

void note_ended(Participant& participant) {
  OpenParticipants& known = open_participants();
  const std::lock_guard<std::mutex> lock(known.mutex);
  known.all.erase(&participant);
}

}  // namespace tfdude
