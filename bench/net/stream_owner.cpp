#include "net/stream_owner.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

#include "net/harness.hpp"

namespace bench {
namespace {

using namespace tfdude;

class Watcher final : public Transport, public TransportHandler {
 public:
  Watcher(std::unique_ptr<Transport> transport, AppliedListener& listener)
      : transport_(std::move(transport)), listener_(listener) {}

  void on_update(const Update& update) override {
    handler_->on_update(update);
    listener_.on_applied(Streamed::kEdges);
  }
  void on_joints(const JointUpdate& update) override {
    handler_->on_joints(update);
    listener_.on_applied(Streamed::kJoints);
  }

  Result<void> start(TransportHandler& handler) override {
    handler_ = &handler;
    return transport_->start(*this);
  }

  // The rest is handed on.
  void stop() override { transport_->stop(); }
  Result<void> serve(const std::string& partition) override { return transport_->serve(partition); }
  void announce(const Presence& presence) override { transport_->announce(presence); }
  void publish(const Page& page) override { transport_->publish(page); }
  void prepare(const std::string& partition) override { transport_->prepare(partition); }
  Result<void> send(const std::string& to, const Request& request, Deadline deadline) override {
    return transport_->send(to, request, deadline);
  }
  Result<void> send(const std::string& to, const Update& update, Deadline deadline) override {
    return transport_->send(to, update, deadline);
  }
  Result<void> send(const std::string& to, const JointUpdate& update, Deadline deadline) override {
    return transport_->send(to, update, deadline);
  }
  Result<void> flush(Deadline deadline) override { return transport_->flush(deadline); }
  void reply(const PeerId& to, const Reply& reply) override { transport_->reply(to, reply); }
  Result<void> watch(std::uint64_t group) override { return transport_->watch(group); }
  void unwatch(std::uint64_t group) override { transport_->unwatch(group); }
  void push(const State& state) override { transport_->push(state); }
  void end_pushing(std::uint64_t group) override { transport_->end_pushing(group); }
  bool settled() const override { return transport_->settled(); }
  bool awaits_presence() const override { return transport_->awaits_presence(); }
  Milliseconds settle_time() const override { return transport_->settle_time(); }
  void on_request(const PeerId& from, const Request& request) override {
    handler_->on_request(from, request);
  }
  void on_reply(const Reply& reply) override { handler_->on_reply(reply); }
  void on_state(const State& state) override { handler_->on_state(state); }
  void on_watcher(std::uint64_t group) override { handler_->on_watcher(group); }
  void on_page(const Page& page) override { handler_->on_page(page); }
  void on_presence(const Presence& presence) override { handler_->on_presence(presence); }
  void on_lost(const std::string& partition, std::uint64_t incarnation) override {
    handler_->on_lost(partition, incarnation);
  }
  bool owns(std::string_view id) const override { return handler_->owns(id); }
  bool owns_joint(std::string_view name) const override { return handler_->owns_joint(name); }

 private:
  std::unique_ptr<Transport> transport_;
  TransportHandler* handler_ = nullptr;
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

std::unique_ptr<Transport> watch(std::unique_ptr<Transport> transport, AppliedListener& listener) {
  return std::make_unique<Watcher>(std::move(transport), listener);
}

}  // namespace bench
