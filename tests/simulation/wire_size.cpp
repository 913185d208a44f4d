#include "simulation/wire_size.hpp"

#include "support/samples.hpp"

namespace tfdude::simulation {
namespace {

using testing::serialized;

struct Size {
  std::size_t operator()(std::monostate) const { return 0; }
  std::size_t operator()(const Presence* one) const {
    return serialized<fastdds::PresenceType>(fastdds::to_wire(*one)).size();
  }
  std::size_t operator()(const Page* one) const {
    return serialized<fastdds::PageType>(fastdds::to_wire(*one)).size();
  }
  // The name of the partition is sent as a hash.
  std::size_t operator()(const Request* one) const {
    return serialized<fastdds::RequestType>(fastdds::to_wire(*one, "")).size();
  }
  std::size_t operator()(const Reply* one) const {
    return serialized<fastdds::ReplyType>(fastdds::to_wire(*one)).size();
  }
  std::size_t operator()(const Update* one) const {
    return serialized<fastdds::UpdateType>(fastdds::to_wire(*one)).size();
  }
  std::size_t operator()(const JointUpdate* one) const {
    return serialized<fastdds::JointsType>(fastdds::to_wire(*one)).size();
  }
  std::size_t operator()(const PushedValues* one) const {
    return serialized<fastdds::StateType>(fastdds::to_wire(*one)).size();
  }
};

}  // namespace

std::size_t wire_size(const Message& message) { return std::visit(Size{}, message); }

}  // namespace tfdude::simulation
