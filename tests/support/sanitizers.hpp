#pragma once

// Defines TFDUDE_THREAD_SANITIZER or TFDUDE_ADDRESS_SANITIZER in builds with one of them. Each
// compiler says so in another way.
#if defined(__SANITIZE_THREAD__)
#define TFDUDE_THREAD_SANITIZER
#elif defined(__SANITIZE_ADDRESS__)
#define TFDUDE_ADDRESS_SANITIZER
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define TFDUDE_THREAD_SANITIZER
#elif __has_feature(address_sanitizer)
#define TFDUDE_ADDRESS_SANITIZER
#endif
#endif
