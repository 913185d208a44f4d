#include "net/stream_owner.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

#include "net/harness.hpp"
#include "support/relay.hpp"

namespace bench {
namespace {

using namespace tfdude;

class Watcher final : public testing::Relay {
 public:
  Watcher(TransportPtr transport, AppliedListener& listener)
      : Relay(std::move(transport)), listener_(listener) {}

 private:
  void on_update(const Update& update) override {
    Relay::on_update(update);
    listener_.on_applied(Streamed::kEdges);
  }
  void on_joints(const JointUpdate& update) override {
    Relay::on_joints(update);
    listener_.on_applied(Streamed::kJoints);
  }

  AppliedListener& listener_;
};

}  // namespace

StreamState& map_stream_state(const std::string& file) {
  constexpr mode_t kOwnerOnly = 0600;
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT, kOwnerOnly);
  if (descriptor < 0 || ::ftruncate(descriptor, sizeof(StreamState)) != 0) {
    give_up(file + " could not be made");
  }
  void* mapped =
      ::mmap(nullptr, sizeof(StreamState), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  if (mapped == MAP_FAILED) give_up(file + " could not be mapped");
  return *static_cast<StreamState*>(mapped);
}

TransportPtr watch(TransportPtr transport, AppliedListener& listener) {
  return std::make_unique<Watcher>(std::move(transport), listener);
}

}  // namespace bench
