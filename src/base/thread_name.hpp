#pragma once

#include <pthread.h>

namespace tfdude {

/// Names the calling thread, as `top -H` shows it.
/// @param name  at most 15 characters; a longer one has no effect
inline void name_this_thread(const char* name) { (void)pthread_setname_np(pthread_self(), name); }

}  // namespace tfdude
