#pragma once

#include <memory>

#include "tfdude/base/export.hpp"

namespace tfdude {

/// A participant's connection to the others. Made by LoopbackNetwork::join() or
/// make_fastdds_transport(), and passed to Client::open() or Node::open(), which start it.
class Transport;

/// Deleter of a transport.
struct TFDUDE_EXPORT TransportEnd {
  TransportEnd() = default;
  template <class Implementation>
  TransportEnd(std::default_delete<Implementation>) {
  }  // NOLINT(google-explicit-constructor): as unique_ptr converts
  void operator()(Transport* transport) const;
};

using TransportPtr = std::unique_ptr<Transport, TransportEnd>;

}  // namespace tfdude
