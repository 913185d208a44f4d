#include "transport/port.hpp"

namespace tfdude {

void TransportEnd::operator()(Transport* transport) const { delete transport; }

}  // namespace tfdude
