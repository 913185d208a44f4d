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

using Intraprocess = eprosima::fastrtps::IntraprocessDeliveryType;
inline constexpr auto kIntraprocessOff = eprosima::fastrtps::INTRAPROCESS_OFF;
inline constexpr auto kIntraprocessUserData = eprosima::fastrtps::INTRAPROCESS_USER_DATA_ONLY;
inline constexpr auto kIntraprocessFull = eprosima::fastrtps::INTRAPROCESS_FULL;

inline void set_intraprocess(Intraprocess delivery) {
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = delivery;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
}

inline Intraprocess intraprocess() {
  return eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings().intraprocess_delivery;
}

#else

using Intraprocess = eprosima::fastdds::IntraprocessDeliveryType;
inline constexpr auto kIntraprocessOff = eprosima::fastdds::INTRAPROCESS_OFF;
inline constexpr auto kIntraprocessUserData = eprosima::fastdds::INTRAPROCESS_USER_DATA_ONLY;
inline constexpr auto kIntraprocessFull = eprosima::fastdds::INTRAPROCESS_FULL;

inline void set_intraprocess(Intraprocess delivery) {
  eprosima::fastdds::LibrarySettings settings;
  settings.intraprocess_delivery = delivery;
  fastdds::edds::DomainParticipantFactory::get_instance()->set_library_settings(settings);
}

inline Intraprocess intraprocess() {
  eprosima::fastdds::LibrarySettings settings;
  fastdds::edds::DomainParticipantFactory::get_instance()->get_library_settings(settings);
  return settings.intraprocess_delivery;
}

#endif

}  // namespace tfdude::testing
