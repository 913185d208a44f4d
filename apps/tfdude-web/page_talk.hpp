#pragma once

#include <memory>
#include <string>

#include "live.hpp"
#include "recordings.hpp"
#include "server.hpp"

namespace tfdude::web {

/// The subprotocol of the page (docs/web.md).
inline constexpr const char* kPageProtocol = "tfdude.v1";

/// What one page is told. A page that takes too long misses pictures, and then gets all that has
/// changed since its last one. `live` and `recordings` must outlive it.
[[nodiscard]] std::unique_ptr<Talk> talk_to_page(Live& live, Recordings& recordings, Post post);

}  // namespace tfdude::web
