#pragma once

// Defines TFDUDE_THREAD_SANITIZER in builds with ThreadSanitizer. Each compiler says so in another
// way.
#if defined(__SANITIZE_THREAD__)
#define TFDUDE_THREAD_SANITIZER
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define TFDUDE_THREAD_SANITIZER
#endif
#endif
