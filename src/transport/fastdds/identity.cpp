#include "transport/fastdds/identity.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
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

// Fast DDS reads each number with the locale of the program, in which the points between them may
// separate thousands. A tab ends a number in any locale.
template <std::size_t kSize>
std::string text_of(const ertps::octet (&bytes)[kSize]) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const ertps::octet byte : bytes) {
    if (!text.empty()) text += "\t.";
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 15U];
  }
  return text;
}

}  // namespace

void be_a_process_of_its_own(edds::DomainParticipantQos& qos) {
  qos.wire_protocol().prefix = new_prefix();
}

void be_a_writer_of_its_own(edds::DataWriterQos& qos) {
  const ertps::GUID_t guid(new_prefix(), 1U);
  const std::string text = text_of(guid.guidPrefix.value) + "\t|" + text_of(guid.entityId.value);
  qos.properties().properties().emplace_back("dds.persistence.guid", text);
}

}  // namespace tfdude::fastdds
