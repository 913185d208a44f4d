#pragma once

#include "transport/fastdds/compat.hpp"

#if TFDUDE_FASTDDS_MAJOR == 2
#include <fastrtps/attributes/LibrarySettingsAttributes.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#else
#include <fastdds/LibrarySettings.hpp>
#endif

// Fast DDS's delivery between participants of one process, as a host program may have set it.
namespace tfdude::testing {

#if TFDUDE_FASTDDS_MAJOR == 2
namespace settings = eprosima::fastrtps;
#else
namespace settings = eprosima::fastdds;
#endif

using Intraprocess = settings::IntraprocessDeliveryType;
inline constexpr auto kIntraprocessOff = settings::INTRAPROCESS_OFF;
inline constexpr auto kIntraprocessUserData = settings::INTRAPROCESS_USER_DATA_ONLY;
inline constexpr auto kIntraprocessFull = settings::INTRAPROCESS_FULL;

#if TFDUDE_FASTDDS_MAJOR == 2

inline void set_intraprocess(Intraprocess delivery) {
  settings::LibrarySettingsAttributes wanted;
  wanted.intraprocess_delivery = delivery;
  settings::xmlparser::XMLProfileManager::library_settings(wanted);
}

inline Intraprocess intraprocess() {
  return settings::xmlparser::XMLProfileManager::library_settings().intraprocess_delivery;
}

#else

inline void set_intraprocess(Intraprocess delivery) {
  settings::LibrarySettings wanted;
  wanted.intraprocess_delivery = delivery;
  fastdds::edds::DomainParticipantFactory::get_instance()->set_library_settings(wanted);
}

inline Intraprocess intraprocess() {
  settings::LibrarySettings found;
  fastdds::edds::DomainParticipantFactory::get_instance()->get_library_settings(found);
  return found.intraprocess_delivery;
}

#endif

}  // namespace tfdude::testing
