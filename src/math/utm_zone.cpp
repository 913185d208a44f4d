#include "tfdude/math/earth.hpp"

// Without GeographicLib, which programs that only print places do not need.
namespace tfdude {

std::string zone_text(const Utm& place) {
  return (place.zone == 0 ? "" : std::to_string(place.zone)) + (place.north ? "N" : "S");
}

}  // namespace tfdude
