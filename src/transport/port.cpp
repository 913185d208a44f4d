#include "transport/port.hpp"

#include "tfdude/base/id.hpp"

namespace tfdude {

std::string IncompatiblePeer::text() const {
  const std::string who = partition.empty() ? "a client" : "partition " + quote(partition);
  return who + " (tf-dude " + (program.empty() ? "of an unknown version" : program) +
         ") speaks protocol " + to_string(protocol) + ", but this program (tf-dude " +
         program_version() + ") speaks " + to_string(kProtocolVersion) + "; update the older one";
}

void TransportEnd::operator()(Transport* transport) const { delete transport; }

}  // namespace tfdude
