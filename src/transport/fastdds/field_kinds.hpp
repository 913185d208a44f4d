#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/base/time.hpp"

#include "base/cdr.hpp"
#include "partition/counters.hpp"
#include "partition/messages.hpp"

// A message is described once: its fields in the order of idl/tfdude.idl, each with its kind. A
// kind has three functions, from which all else follows:
// - check() passes over the bytes of a field: every length is within the bytes present, and within
//   the bounds of the IDL. The generated code checks neither, and allocates whatever a length says;
// - write() sets the generated field from a message. It keeps the memory that the field has;
// - read() sets the message from the generated field, and checks its value.
namespace tfdude::fastdds {

/// What is being read, to begin an error with.
struct Place {
  const char* what = "";
  std::optional<std::string_view> frame{};  ///< instead: this frame

  [[nodiscard]] tl::unexpected<Error> fail(const Error& error) const {
    return fail_at(frame ? "frame " + quote(*frame) : what, error);
  }
};

// ---- numbers

/// A number of this type in the IDL; also a flag or an enumeration whose values are not checked.
template <class Wire>
struct Number {
  static void check(CdrReader& in) { in.skip(sizeof(Wire), sizeof(Wire)); }
  template <class Value>
  static void write(const Value& value, Wire& wire) {
    wire = static_cast<Wire>(value);
  }
  template <class Value>
  static Result<void> read(const Wire& wire, Value& value, const Place&) {
    value = static_cast<Value>(wire);
    return {};
  }
};

using Octet = Number<std::uint8_t>;
using Count32 = Number<std::uint32_t>;
using Count64 = Number<std::uint64_t>;
using Real = Number<double>;

/// A number that others count on from (counters.hpp).
struct Counter : Count64 {
  const char* field;
  std::uint64_t last;
  explicit constexpr Counter(const char* name, std::uint64_t its_last = kLastCounter)
      : field(name), last(its_last) {}

  Result<void> read(std::uint64_t wire, std::uint64_t& value, const Place& place) const {
    if (wire > last) {
      return tfdude::fail(Errc::kInvalidInput, std::string(field) + " of " + std::to_string(wire) +
                                                   " is beyond " + std::to_string(last));
    }
    return Count64::read(wire, value, place);
  }
};

inline constexpr Counter kLamportTime{"a Lamport time"};
inline constexpr Counter kEpoch{"an epoch"};
inline constexpr Counter kIncarnation{"an incarnation", kLastIncarnation};

/// A boolean of the IDL: the generated code throws at any other value than 0 and 1.
struct Boolean : Number<bool> {
  static void check(CdrReader& in) {
    if (in.u8() > 1) in.fail();
  }
};

/// A number that the message does not have: it is set elsewhere, and not read.
template <class Wire>
struct NotOfMessage {
  static void check(CdrReader& in) { Number<Wire>::check(in); }
  template <class Message>
  static void write(const Message&, Wire&) {}
  template <class Message>
  static Result<void> read(const Wire&, const Message&, const Place&) {
    return {};
  }
};

/// An enumeration in an octet, up to its last value.
template <class Enum>
struct Enumerated {
  Enum last;
  const char* of;
  constexpr Enumerated(Enum its_last, const char* what) : last(its_last), of(what) {}

  static void check(CdrReader& in) { Octet::check(in); }
  static void write(Enum value, std::uint8_t& wire) { Octet::write(value, wire); }
  Result<void> read(std::uint8_t wire, Enum& value, const Place& place) const {
    if (wire < 1 || wire > static_cast<std::uint8_t>(last)) {
      return tfdude::fail(Errc::kInvalidInput,
                          "unknown kind " + std::to_string(wire) + " of " + of);
    }
    return Octet::read(wire, value, place);
  }
};

/// Nanoseconds of any sign.
struct Nanoseconds : Number<std::int64_t> {
  static void write(std::chrono::nanoseconds value, std::int64_t& wire) { wire = value.count(); }
  static Result<void> read(std::int64_t wire, std::chrono::nanoseconds& value, const Place&) {
    value = std::chrono::nanoseconds(wire);
    return {};
  }
};

[[nodiscard]] inline tl::unexpected<Error> negative(const char* field, std::int64_t wire) {
  return fail(Errc::kInvalidInput,
              std::string(field) + " of " + std::to_string(wire) + " ns is negative");
}

/// Nanoseconds that are not negative.
struct Duration : Nanoseconds {
  const char* field;
  explicit constexpr Duration(const char* name) : field(name) {}

  Result<void> read(std::int64_t wire, std::chrono::nanoseconds& value, const Place& place) const {
    if (wire < 0) return negative(field, wire);
    return Nanoseconds::read(wire, value, place);
  }
};

/// What is sent instead of an absent stamp.
inline constexpr std::int64_t kNoStamp = -1;

[[nodiscard]] inline std::int64_t wire_stamp(std::optional<Time> stamp) {
  return stamp ? nanoseconds(*stamp) : kNoStamp;
}

/// An instant that may be absent, and is not negative.
struct Stamp : Number<std::int64_t> {
  const char* field;
  explicit constexpr Stamp(const char* name) : field(name) {}

  static void write(const std::optional<Time>& value, std::int64_t& wire) {
    wire = wire_stamp(value);
  }
  Result<void> read(std::int64_t wire, std::optional<Time>& value, const Place&) const {
    if (wire < kNoStamp) return negative(field, wire);
    value = wire == kNoStamp ? std::nullopt : std::optional(time_of(wire));
    return {};
  }
};

/// An instant of any sign.
struct Instant : Number<std::int64_t> {
  static void write(Time value, std::int64_t& wire) { wire = nanoseconds(value); }
  static Result<void> read(std::int64_t wire, Time& value, const Place&) {
    value = time_of(wire);
    return {};
  }
};

// ---- texts

template <class WireText>
[[nodiscard]] std::string_view text(const WireText& wire) {
  return {wire.c_str(), wire.size()};
}

/// An Identifier of the IDL that is not checked: where it names nothing, that is found later.
struct Text {
  static void check(CdrReader& in) { in.bounded_text(kMaxIdBytes); }
  template <class Wire>
  static void write(const std::string& value, Wire& wire) {
    wire = value;
  }
  template <class Wire>
  static Result<void> read(const Wire& wire, std::string& value, const Place&) {
    value = text(wire);
    return {};
  }
};

/// A name for people to read, though its sender may have put anything in it.
struct Shown : Text {
  template <class Wire>
  static Result<void> read(const Wire& wire, std::string& value, const Place&) {
    value = printable(text(wire));
    return {};
  }
};

/// The id of a frame, or another name that follows the same rules.
struct Id : Text {
  const char* field;
  bool may_be_empty;
  explicit constexpr Id(const char* name, bool optional = false)
      : field(name), may_be_empty(optional) {}

  template <class Wire>
  Result<void> read(const Wire& wire, std::string& value, const Place& place) const {
    if (wire.size() > 0 || !may_be_empty) {
      if (auto ok = check_id(text(wire), field); !ok) return ok;
    }
    return Text::read(wire, value, place);
  }
};

/// The id of the frame that the next fields are about.
struct FrameId : Text {
  template <class Wire>
  static Result<void> read(const Wire& wire, std::string& value, Place& place) {
    place.frame = text(wire);
    return Id("id").read(wire, value, place);
  }
};

struct PartitionName : Text {
  bool may_be_empty;
  explicit constexpr PartitionName(bool optional = false) : may_be_empty(optional) {}

  template <class Wire>
  Result<void> read(const Wire& wire, std::string& value, const Place& place) const {
    if (wire.size() > 0 || !may_be_empty) {
      if (auto ok = check_partition_name(text(wire)); !ok) return ok;
    }
    return Text::read(wire, value, place);
  }
};

/// A text of any length in the IDL; only so much of it is sent, or received.
struct LongText {
  std::size_t most;

  void check(CdrReader& in) const { in.bounded_text(most); }
  void write(const std::string& value, std::string& wire) const { wire.assign(value, 0, most); }
  static Result<void> read(const std::string& wire, std::string& value, const Place&) {
    value = wire;
    return {};
  }
};

// ---- sequences

template <class Element>
struct List {
  Element element;
  std::uint32_t most;
  std::size_t elsewhere;

  /// @param first  the message's first elements are other fields, which come before
  explicit constexpr List(Element of, std::uint32_t at_most = kMaxItems, std::size_t first = 0)
      : element(of), most(at_most), elsewhere(first) {}

  void check(CdrReader& in) const {
    in.sequence(most, [&] { element.check(in); });
  }
  template <class Value, class Wire>
  void write(const std::vector<Value>& values, std::vector<Wire>& wire) const {
    wire.resize(values.size() - elsewhere);
    for (std::size_t i = 0; i < wire.size(); ++i) element.write(values[elsewhere + i], wire[i]);
  }
  template <class Value, class Wire>
  Result<void> read(const std::vector<Wire>& wire, std::vector<Value>& values, Place& place) const {
    return read_if(wire, values, place, [](const Wire&) { return true; });
  }
  /// Only those elements that the predicate accepts; the others are not even checked.
  template <class Value, class Wire, class Accept>
  Result<void> read_if(const std::vector<Wire>& wire, std::vector<Value>& values, Place& place,
                       Accept accept) const {
    values.resize(elsewhere);
    values.reserve(elsewhere + wire.size());
    for (const Wire& one : wire) {
      if (!accept(one)) continue;
      if (auto ok = element.read(one, values.emplace_back(), place); !ok) return ok;
    }
    return {};
  }
};

/// A list of which no more than the first elements are sent.
template <class Of>
struct FirstOf : Of {
  explicit constexpr FirstOf(Of list) : Of(list) {}

  template <class Value, class Wire>
  void write(const std::vector<Value>& values, std::vector<Wire>& wire) const {
    const auto end = values.begin() +
                     static_cast<std::ptrdiff_t>(std::min<std::size_t>(values.size(), this->most));
    if (end == values.end()) return Of::write(values, wire);
    Of::write(std::vector<Value>(values.begin(), end), wire);
  }
};

/// A value that may be absent, as a sequence.
template <class Element>
struct AtMostOne {
  Element element;
  explicit constexpr AtMostOne(Element of) : element(of) {}

  void check(CdrReader& in) const {
    in.sequence(1, [&] { element.check(in); });
  }
  template <class Value, class Wire>
  void write(const std::optional<Value>& value, std::vector<Wire>& wire) const {
    wire.resize(value ? 1 : 0);
    if (value) element.write(*value, wire[0]);
  }
  template <class Value, class Wire>
  Result<void> read(const std::vector<Wire>& wire, std::optional<Value>& value,
                    const Place& place) const {
    value.reset();
    return wire.empty() ? Result<void>() : element.read(wire.front(), value.emplace(), place);
  }
};

}  // namespace tfdude::fastdds
