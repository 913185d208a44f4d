#pragma once

#include <memory>

#include "tfdude/base/export.hpp"
#include "tfdude/transport/transport.hpp"

namespace tfdude {

/// A network inside one process, for tests, examples and single-process programs. Every message is
/// delivered before the send returns, in the caller's thread.
class TFDUDE_EXPORT LoopbackNetwork {
 public:
  LoopbackNetwork();

  /// Creates a participant's access to this network. It keeps the network alive.
  [[nodiscard]] TransportPtr join();

 private:
  friend class LoopbackTransport;
  class Hub;
  std::shared_ptr<Hub> hub_;
};

}  // namespace tfdude
