#pragma once

#include <memory>

#include "tfdude/base/export.hpp"
#include "tfdude/transport/transport.hpp"

namespace tfdude {

/// A network inside one process: for tests, examples and programs that are one process. Whatever is sent
/// is delivered before the call returns, in the caller's thread.
class TFDUDE_EXPORT LoopbackNetwork {
 public:
  LoopbackNetwork();

  /// A participant's access to this network, which it keeps alive.
  [[nodiscard]] TransportPtr join();

 private:
  friend class LoopbackTransport;
  class Hub;
  std::shared_ptr<Hub> hub_;
};

}  // namespace tfdude
