#include "transport/fastdds/identity.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <sstream>
#include <string>
#include <unistd.h>

namespace tfdude::fastdds {
namespace {

// Of RTPS 2.2, section 8.2.4.2, and Fast DDS's GuidUtils: vendor, host, process, participant.
constexpr std::size_t kHost = 2;
constexpr std::size_t kProcess = 4;

// The same for all processes of a host, as Fast DDS has it.
std::uint16_t host_id() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return 0;
  return static_cast<std::uint16_t>(std::hash<std::string>()(name.data()));
}

ertps::GuidPrefix_t new_prefix() {
  ertps::GuidPrefix_t prefix;
  prefix.value[0] = etransport::c_VendorId_eProsima[0];
  prefix.value[1] = etransport::c_VendorId_eProsima[1];
  const std::uint16_t host = host_id();
  prefix.value[kHost] = static_cast<ertps::octet>(host & 0xFFU);
  prefix.value[kHost + 1] = static_cast<ertps::octet>(host >> 8U);
  std::random_device random;
  std::generate(prefix.value + kProcess, prefix.value + ertps::GuidPrefix_t::size,
                [&] { return static_cast<ertps::octet>(random() & 0xFFU); });
  return prefix;
}

}  // namespace

void be_a_process_of_its_own(edds::DomainParticipantQos& qos) {
  qos.wire_protocol().prefix = new_prefix();
}

void be_a_writer_of_its_own(edds::DataWriterQos& qos) {
  std::ostringstream guid;
  guid << ertps::GUID_t(new_prefix(), 1U);
  qos.properties().properties().emplace_back("dds.persistence.guid", guid.str());
}

}  // namespace tfdude::fastdds
