#include "tfdude/client/one_shot.hpp"

#include "memory/one_shot_socket.hpp"
#include "transport/network.hpp"

namespace tfdude {

std::optional<OneShotAnswer> look_up_once(const OneShotQuestion& question, const Options& options) {
  const bool can = options.shared_memory && options.keys.empty() &&
                   options.discovery_server.empty() && options.domain != kNoDomain;
  const std::string network = can ? network_of(options.domain, options.profile) : std::string();
  return network.empty() ? std::nullopt : ask_once(network, question);
}

}  // namespace tfdude
