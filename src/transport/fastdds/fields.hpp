#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/field_kinds.hpp"

// Descriptions of messages, from kinds of fields (field_kinds.hpp). A description is a kind, too.
namespace tfdude::fastdds {

// ---- structs

template <class OfWire, class OfMessage, class Of>
struct Field {
  OfWire of_wire;
  OfMessage of_message;
  Of kind;
};

template <class... Fields>
struct Record {
  std::tuple<Fields...> fields;

  void check(CdrReader& in) const {
    std::apply([&](const Fields&... field) { (field.kind.check(in), ...); }, fields);
  }
  template <class Message, class Wire>
  void write(const Message& message, Wire& wire) const {
    std::apply(
        [&](const Fields&... field) {
          (field.kind.write(field.of_message(message), field.of_wire(wire)), ...);
        },
        fields);
  }
  template <class Wire, class Message>
  Result<void> read(const Wire& wire, Message& message, Place place) const {
    Result<void> ok;
    const auto read_one = [&](const auto& field) {
      auto one = field.kind.read(field.of_wire(wire), field.of_message(message), place);
      if (!one) ok = std::move(one);
      return ok.has_value();
    };
    std::apply([&](const Fields&... field) { (void)(read_one(field) && ...); }, fields);
    return ok;
  }
};

template <class... Fields>
constexpr Record<Fields...> record(Fields... fields) {
  return {std::tuple<Fields...>(fields...)};
}

template <class OfWire, class OfMessage, class Of>
constexpr Field<OfWire, OfMessage, Of> field(OfWire of_wire, OfMessage of_message, Of kind) {
  return {of_wire, of_message, kind};
}

// NOLINTBEGIN(cppcoreguidelines-macro-usage): the accessors of the generated code have no type
#define TFDUDE_WIRE(name) [](auto& wire) -> decltype(auto) { return wire.name(); }
#define TFDUDE_MEMBER(member) \
  [](auto& message) -> auto& { return message.member; }
#define TFDUDE_ALL \
  [](auto& all) -> auto& { return all; }
/// A field of the generated struct, the member of the message, and their kind...
#define TFDUDE_FIELD(name, member, kind) field(TFDUDE_WIRE(name), TFDUDE_MEMBER(member), kind)
/// ...that depends on more of the message...
#define TFDUDE_FIELD_OF_ALL(name, kind) field(TFDUDE_WIRE(name), TFDUDE_ALL, kind)
/// ...and a member that depends on several fields of the generated struct, or is all of it.
#define TFDUDE_FIELDS(member, kind) field(TFDUDE_ALL, TFDUDE_MEMBER(member), kind)
// NOLINTEND(cppcoreguidelines-macro-usage)

/// A struct with a rule about several of its fields: rule(message) is a Result<void>.
template <class Of, class Rule>
struct Ruled : Of {
  Rule rule;
  constexpr Ruled(Of of, Rule its_rule) : Of(of), rule(its_rule) {}

  template <class Wire, class Message>
  Result<void> read(const Wire& wire, Message& message, const Place& place) const {
    auto ok = Of::read(wire, message, place);
    return ok ? rule(message) : ok;
  }
};

template <class Message, class Elements>
constexpr auto at_least_one(Elements Message::*list, const char* error) {
  return [=](const Message& message) -> Result<void> {
    if (!(message.*list).empty()) return {};
    return fail(Errc::kInvalidInput, error);
  };
}

// ---- unions

/// One kind of a message, with its number in the union of the IDL.
template <std::uint8_t kNumber, class MessageType, class OfWire, class Select, class Of, class When>
struct Case {
  using Message = MessageType;
  OfWire of_wire;
  Select select;
  Of kind;
  When when;

  static constexpr bool has(std::uint8_t number) { return number == kNumber; }
  void check(CdrReader& in) const { kind.check(in); }

  template <class Wire>
  bool write(const Message& message, Wire& wire) const {
    if (!when(message)) return false;
    if (wire._d() != kNumber) select(wire);
    kind.write(message, of_wire(wire));
    return true;
  }
  template <class Other, class Wire>
  bool write(const Other&, Wire&) const {
    return false;
  }
  template <class Wire, class Variant>
  Result<void> read(const Wire& wire, Variant& body, Place& place) const {
    return kind.read(of_wire(wire), body.template emplace<Message>(), place);
  }
};

struct Always {
  template <class Message>
  constexpr bool operator()(const Message&) const {
    return true;
  }
};

template <std::uint8_t kNumber, class Message, class OfWire, class Select, class Of,
          class When = Always>
constexpr Case<kNumber, Message, OfWire, Select, Of, When> make_case(OfWire of_wire, Select select,
                                                                     Of kind, When when = {}) {
  return {of_wire, select, kind, when};
}

// NOLINTBEGIN(cppcoreguidelines-macro-usage): as above
#define TFDUDE_SELECT(name) \
  [](auto& wire) { wire.name(std::decay_t<decltype(std::as_const(wire).name())>()); }
#define TFDUDE_CASE(number, Message, name, kind) \
  make_case<number, Message>(TFDUDE_WIRE(name), TFDUDE_SELECT(name), kind)
/// Of several cases for one message, the first for which when(message) is true is written.
#define TFDUDE_CASE_IF(number, Message, name, kind, when) \
  make_case<number, Message>(TFDUDE_WIRE(name), TFDUDE_SELECT(name), kind, when)
// NOLINTEND(cppcoreguidelines-macro-usage)

/// An octet that is neither written nor read here.
template <std::uint8_t kNumber>
struct SignOfLife {
  using Message = void;
  static constexpr bool has(std::uint8_t number) { return number == kNumber; }
  static void check(CdrReader& in) { Octet::check(in); }
  template <class Any, class Wire>
  static bool write(const Any&, Wire&) {
    return false;
  }
  template <class Wire, class Variant>
  static Result<void> read(const Wire&, Variant&, const Place&) {
    return fail(Errc::kUnsupported, "a sign of life has no content");
  }
};

/// The table of all kinds of requests, or of replies.
template <class... All>
struct Cases {
  const char* what;
  std::tuple<All...> all;

  // Of a kind of a later version no more than its number is read.
  void check(CdrReader& in) const {
    const std::uint8_t number = in.u8();
    std::apply(
        [&](const All&... one) { (void)((one.has(number) && (one.check(in), true)) || ...); }, all);
  }
  template <class... Messages, class Wire>
  void write(const std::variant<Messages...>& body, Wire& wire) const {
    std::visit(
        [&](const auto& message) {
          using Message = std::decay_t<decltype(message)>;
          static_assert((std::is_same_v<Message, typename All::Message> || ...));
          std::apply([&](const All&... one) { (void)(one.write(message, wire) || ...); }, all);
        },
        body);
  }
  template <class Wire, class Variant>
  Result<void> read(const Wire& wire, Variant& body, Place& place) const {
    const std::uint8_t number = wire._d();
    Result<void> ok;
    const auto read_it = [&](const auto& one) {
      if (!one.has(number)) return false;
      ok = one.read(wire, body, place);
      return true;
    };
    if (std::apply([&](const All&... one) { return (read_it(one) || ...); }, all)) return ok;
    // Which one it is, is not known either: Fast DDS 3 replaces the number.
    return fail(Errc::kUnsupported, "this kind of " + std::string(what) +
                                        " is not known to protocol " + to_string(kProtocolVersion));
  }
};

template <class... All>
constexpr Cases<All...> cases(const char* what, All... all) {
  return {what, std::tuple<All...>(all...)};
}

// ---- messages

template <class Of>
[[nodiscard]] bool well_formed(const Of& kind, const std::uint8_t* data, std::size_t size) {
  CdrReader in(data, size);
  kind.check(in);
  return in.good();
}

template <class Message, class Of, class Wire>
[[nodiscard]] Result<Message> read_as(const Of& kind, const Wire& wire, Place place) {
  Result<Message> message;
  if (auto ok = kind.read(wire, *message, place); !ok) return tl::unexpected(std::move(ok.error()));
  return message;
}

}  // namespace tfdude::fastdds
