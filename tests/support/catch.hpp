#pragma once

// The only file that depends on the version of Catch2: 3 (Debian 13) or 2 (Debian 12). Names that
// differ are defined in tfdude::testing.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
#else
#include <catch2/catch.hpp>
#endif

#include "tfdude/base/result.hpp"

/// Prints an unexpected result: its error's message.
template <class T>
struct Catch::StringMaker<tl::expected<T, tfdude::Error>> {
  static std::string convert(const tl::expected<T, tfdude::Error>& result) {
    return result ? "done" : "error: " + result.error().message;
  }
};

namespace tfdude::testing {

#if __has_include(<catch2/catch_all.hpp>)
using Catch::Approx;
using Catch::Matchers::ContainsSubstring;
#else
using Catch::Detail::Approx;
inline auto ContainsSubstring(const std::string& text) { return Catch::Matchers::Contains(text); }
#endif

}  // namespace tfdude::testing
