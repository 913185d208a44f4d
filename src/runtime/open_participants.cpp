#include "runtime/open_participants.hpp"

#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <unistd.h>

#include "base/acting_thread.hpp"
#include "runtime/participant.hpp"

namespace tfdude {
namespace {

struct OpenParticipants {
  std::mutex mutex;
  std::set<Participant*> all;
  pid_t process = getpid();
};

// Never destroyed: participants may end after all else.
OpenParticipants& open_participants() {
  static auto* const known = new OpenParticipants;
  return *known;
}

struct AtExit {
  AtExit() = default;
  AtExit(const AtExit&) = delete;
  AtExit& operator=(const AtExit&) = delete;
  ~AtExit() {
    OpenParticipants& known = open_participants();
    if (known.process != getpid()) return;
    // By a thread whose own variables are not destroyed yet, as those of this one may be.
    try {
      std::thread([&known, exiting = std::this_thread::get_id()] {
        act_for(exiting);
        end_all(known);
      }).join();
    } catch (const std::system_error&) {
      // Without another thread, what is open goes on until the process is gone.
    }
  }

 private:
  // Without the lock: it waits for functions of the program, which may open or end others.
  static void end_all(OpenParticipants& known) {
    while (Participant* const participant = taken(known)) participant->end();
  }
  static Participant* taken(OpenParticipants& known) {
    const std::lock_guard<std::mutex> lock(known.mutex);
    return known.all.empty() ? nullptr : known.all.extract(known.all.begin()).value();
  }
};

}  // namespace

void note_open(Participant& participant) {
  OpenParticipants& known = open_participants();
  // What was made before it is destroyed after it.
  static const AtExit at_exit;
  const std::lock_guard<std::mutex> lock(known.mutex);
  known.all.insert(&participant);
}

void note_ended(Participant& participant) {
  OpenParticipants& known = open_participants();
  const std::lock_guard<std::mutex> lock(known.mutex);
  known.all.erase(&participant);
}

}  // namespace tfdude
