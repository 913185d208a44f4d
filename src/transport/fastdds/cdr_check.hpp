#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "partition/messages.hpp"

// Reads the bytes of DDS samples without deserializing them: whether they are well formed (every
// length within the bytes present and within the bounds of idl/tfdude.idl), and the fields that a
// filter needs. The generated code checks neither bounds nor discriminators, and allocates whatever
// size a length says.
namespace tfdude::fastdds {

[[nodiscard]] bool well_formed_request(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_reply(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_update(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_joints(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_state(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_clock(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_page(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_presence(const std::uint8_t* data, std::size_t size);

/// What a filter must know of a request; the id points into the sample. It comes before the body,
/// so that also requests of later versions can be answered.
struct RequestHead {
  std::string_view id;
  std::uint32_t addressee = 0;
};

/// @return false if the request is not well formed.
[[nodiscard]] bool read_request_head(const std::uint8_t* data, std::size_t size, RequestHead& head);

/// Calls a predicate with the id of each edge of an update until it says true.
/// @return whether it did; false if the update is not well formed so far.
template <class Predicate>
[[nodiscard]] bool any_edge(const std::uint8_t* data, std::size_t size, Predicate predicate);

/// The same with the name of each joint of a sample of joints.
template <class Predicate>
[[nodiscard]] bool any_joint(const std::uint8_t* data, std::size_t size, Predicate predicate);

/// FNV-1a, 32 bits: how a request names the partition that it is addressed to.
[[nodiscard]] constexpr std::uint32_t addressee_of(std::string_view partition) {
  std::uint32_t hash = 2166136261U;
  for (const char c : partition) hash = (hash ^ static_cast<std::uint8_t>(c)) * 16777619U;
  return hash;
}

namespace detail {

/// Reads plain CDR of either byte order. After the end or a violated bound, all further steps fail.
class CdrWalk {
 public:
  CdrWalk(const std::uint8_t* data, std::size_t size);

  [[nodiscard]] bool good() const { return good_; }
  std::uint8_t octet();
  void boolean();
  std::uint32_t ulong();
  void skip(std::size_t bytes, std::size_t alignment);
  std::string_view string(std::size_t max_bytes);
  /// Reads a sequence's length, then calls element() as often, as long as all is good.
  template <class Element>
  void sequence(Element element, std::uint32_t most = kMaxItems) {
    const std::uint32_t length = ulong();
    if (length > most) good_ = false;
    for (std::uint32_t i = 0; i < length && good_; ++i) element();
  }

  std::string_view id() { return string(255); }
  /// A sequence of doubles.
  void numbers(std::uint32_t most);
  void transform() { numbers(28); }
  void path_ends();
  void transforms();
  void correlation();
  void correlated_transforms();
  void unspecified_edges();
  void revised_edge();
  void state();
  std::string_view edge();
  std::string_view joint();

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
  bool big_endian_ = false;
  bool good_ = true;
};

}  // namespace detail

namespace detail {

// A stamped sequence, the element of which reads its id.
template <class Predicate>
bool any_id(const std::uint8_t* data, std::size_t size, std::string_view (CdrWalk::*element)(),
            Predicate predicate) {
  CdrWalk walk(data, size);
  bool found = false;
  walk.sequence([&] {
    const std::string_view id = (walk.*element)();
    if (!found && walk.good()) found = predicate(id);
  });
  walk.skip(8, 8);
  return found && walk.good();
}

}  // namespace detail

template <class Predicate>
bool any_edge(const std::uint8_t* data, std::size_t size, Predicate predicate) {
  return detail::any_id(data, size, &detail::CdrWalk::edge, predicate);
}

template <class Predicate>
bool any_joint(const std::uint8_t* data, std::size_t size, Predicate predicate) {
  return detail::any_id(data, size, &detail::CdrWalk::joint, predicate);
}

}  // namespace tfdude::fastdds
