#pragma once

namespace tfdude {

class Participant;

// The participants of this process. What is still open when it exits is ended then: a client in a
// global variable, or in a function that calls std::exit(), would otherwise go on after what it
// needs of Fast DDS, and of this library, was destroyed. A child of fork() has no threads to end.
// Thread-safe.

/// From now on it is ended at exit. Call after all is made that it needs.
void note_open(Participant& participant);
/// The participant ends by itself.
void note_ended(Participant& participant);

}  // namespace tfdude
