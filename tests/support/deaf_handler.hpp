#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "transport/port.hpp"

namespace tfdude::testing {

/// Ignores everything that arrives, and owns nothing; subclasses override what shall differ.
class DeafHandler : public TransportHandler {
 public:
  void on_request(const PeerId&, const Request&) override {}
  void on_reply(const std::string&, const Reply&) override {}
  void on_update(const Update&) override {}
  void on_joints(const JointUpdate&) override {}
  void on_pushed(const PushedValues&) override {}
  void on_page(const Page&) override {}
  void on_presence(const Presence&) override {}
  void on_lost(const std::string&, std::uint64_t, std::chrono::nanoseconds) override {}
  [[nodiscard]] bool owns(std::string_view) const override { return false; }
  [[nodiscard]] bool owns_joint(std::string_view) const override { return false; }
};

}  // namespace tfdude::testing
