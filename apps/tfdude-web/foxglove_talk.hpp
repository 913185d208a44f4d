#pragma once

#include <memory>
#include <string>
#include <vector>

#include "live.hpp"
#include "server.hpp"

namespace tfdude::web {

/// The subprotocols of Foxglove and Lichtblick, which are the same so far.
inline const std::vector<std::string> kFoxgloveProtocols = {"foxglove.sdk.v1",
                                                            "foxglove.websocket.v1"};

/// What a client of these protocols is told. `live` must outlive it.
[[nodiscard]] std::unique_ptr<Talk> talk_to_foxglove(Live& live);

}  // namespace tfdude::web
