#pragma once

#include <string>

#include "support/cdr.hpp"
#include "transport/fastdds/codec.hpp"

// Whether samples that are built by hand are well formed, by topic.
namespace tfdude::testing::well_formed {

[[nodiscard]] inline bool request(const Cdr& cdr) {
  return fastdds::well_formed_request(cdr.bytes().data(), cdr.bytes().size());
}
[[nodiscard]] inline bool state(const Cdr& cdr) {
  return fastdds::well_formed_state(cdr.bytes().data(), cdr.bytes().size());
}
[[nodiscard]] inline bool reply(const Cdr& cdr) {
  return fastdds::well_formed_reply(cdr.bytes().data(), cdr.bytes().size());
}
[[nodiscard]] inline bool update(const Cdr& cdr) {
  return fastdds::well_formed_update(cdr.bytes().data(), cdr.bytes().size());
}
[[nodiscard]] inline bool joints(const Cdr& cdr) {
  return fastdds::well_formed_joints(cdr.bytes().data(), cdr.bytes().size());
}
[[nodiscard]] inline bool page(const Cdr& cdr) {
  return fastdds::well_formed_page(cdr.bytes().data(), cdr.bytes().size());
}
[[nodiscard]] inline bool presence(const Cdr& cdr) {
  return fastdds::well_formed_presence(cdr.bytes().data(), cdr.bytes().size());
}

// The fields of a presence until its list of those who are absent.
[[nodiscard]] inline Cdr presence_from(const std::string& host, unsigned serving) {
  Cdr cdr;
  cdr.string("r").ulonglong(0).string(host).ulong(0).ulong(0).ulong(0).octet(serving);
  return cdr;
}

// And those after it.
[[nodiscard]] inline Cdr presence_end(Cdr cdr) {
  return cdr.ulonglong(0).octet(0).octet(0).ushort(1).ushort(0).string("0.1.0").numbers(0);
}

}  // namespace tfdude::testing::well_formed
