#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/transport/fastdds.hpp"

#include "base/mutex.hpp"
#include "transport/fastdds/attention.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/owned_filter.hpp"
#include "transport/fastdds/peers.hpp"
#include "transport/fastdds/push_channels.hpp"
#include "transport/fastdds/worker.hpp"
#include "transport/fastdds/writer_table.hpp"
#include "transport/port.hpp"

namespace tfdude::fastdds {

/// Requests and updates are sent in the DDS partition named like the tf-dude partition, replies in
/// one of the peer's own, presence and directory in the default one. A sender keeps a writer for
/// each partition, and an owner one for each peer, so messages reach only those concerned.
class FastDdsTransport final : public Transport {
 public:
  explicit FastDdsTransport(FastDdsOptions options);
  ~FastDdsTransport() override { stop(); }
  FastDdsTransport(const FastDdsTransport&) = delete;
  FastDdsTransport& operator=(const FastDdsTransport&) = delete;

  Result<void> start(TransportHandler& handler) override;
  void stop() override;
  Result<void> serve(const std::string& partition) override;
  void announce(const Presence& presence) override;
  void publish(const Page& page) override;
  void prepare(const std::string& partition) override;
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override;
  Result<void> send(const std::string& partition, const Update& update, Deadline deadline) override;
  Result<void> send(const std::string& partition, const JointUpdate& update,
                    Deadline deadline) override;
  std::unique_ptr<Channel<Update>> update_channel(const std::string& partition) override;
  std::unique_ptr<Channel<JointUpdate>> joint_channel(const std::string& partition) override;
  Result<void> flush(Deadline deadline) override;
  void reply(const PeerId& to, const Reply& reply) override;
  Result<void> watch(std::uint64_t group) override { return push_channels_->watch(group); }
  void unwatch(std::uint64_t group) override { push_channels_->unwatch(group); }
  void push(const PushedValues& pushed) override { push_channels_->push(pushed); }
  void end_pushing(std::uint64_t group) override { push_channels_->end_pushing(group); }
  bool discovered() const override { return peers_.discovered(); }
  bool awaits_presence() const override { return peers_.awaits_presence(); }
  std::vector<IncompatiblePeer> incompatible() const override { return peers_.incompatible(); }
  Milliseconds discovery_time() const override;

  // Of ParticipantListener, from a thread of the library.
  void met(const ertps::GuidPrefix_t& prefix, const std::string& name,
           const std::vector<std::uint8_t>& user_data);
  void left(const ertps::GuidPrefix_t& prefix);

 private:
  struct Topics {
    edds::Topic* request = nullptr;
    edds::Topic* reply = nullptr;
    edds::Topic* update = nullptr;
    edds::Topic* joint = nullptr;
    edds::Topic* state = nullptr;
    edds::Topic* directory = nullptr;
    edds::Topic* presence = nullptr;
  };

  Result<void> create_participant();
  Result<void> create_endpoints();
  void take_times(edds::DomainParticipantQos& qos);
  edds::Topic* create_topic(const char* name, const edds::TypeSupport& type);
  edds::ContentFilteredTopic* create_filtered(edds::Topic* topic, const std::string& partition);

  Milliseconds keep_in_touch();
  [[nodiscard]] std::set<std::string> used_owners() const;
  void probe(const std::string& partition);
  bool announce_count();
  [[nodiscard]] Context context() const { return {*participant_, *profiles_, *gate_, *counters_}; }
  /// A table whose writers are in the DDS partitions of their names.
  WriterTable<std::string> writers_of(edds::Topic*& topic, const char* profile);
  void open_reply_writer(const PeerId& peer);
  void reply(const PeerId& to, wire::Reply sample);
  Result<void> send(Writer& writer, const std::string& partition, void* sample, Deadline deadline);

  void take_request(const wire::Request& sample, const ertps::GuidPrefix_t& from);
  void take_update(const wire::Update& sample);
  void take_joints(const wire::Joints& sample);
  void take_reply(const wire::Reply& sample);
  void take_page(const wire::Page& sample, const ertps::GuidPrefix_t& from);
  void take_presence(const wire::Presence& sample, const ertps::GuidPrefix_t& from);

  const FastDdsOptions options_;
  const std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::optional<Profiles> profiles_;
  const std::shared_ptr<FastDdsCounters> counters_;
  TransportHandler* handler_ = nullptr;
  const std::shared_ptr<LifeSigns> life_signs_ = std::make_shared<LifeSigns>();
  Peers peers_{life_signs_, [this](const Presence& presence) { handler_->on_presence(presence); },
               [this](const Presence& presence, std::chrono::nanoseconds early) {
                 handler_->on_lost(presence.partition, presence.incarnation, early);
               }};

  ParticipantListener<FastDdsTransport> participant_listener_{*this};
  edds::DomainParticipant* participant_ = nullptr;
  PeerId self_{};
  Topics topics_;

  Mutex presence_mutex_{LockRank::kAnnouncing};
  // What this participant serves, as last announced, and when that was.
  std::optional<wire::Presence> said_ TFDUDE_GUARDED_BY(presence_mutex_);
  Peers::Clock::time_point said_at_ TFDUDE_GUARDED_BY(presence_mutex_);

  Attention attention_;
  Milliseconds next_look_{};      // only for the worker
  bool announced_by_dds_ = true;  // participants hear the announcements of DDS; set at the start

  WriterTable<std::string> request_writers_{writers_of(topics_.request, "call_writer")};
  WriterTable<std::string> update_writers_{writers_of(topics_.update, "update_writer")};
  WriterTable<std::string> joint_writers_{writers_of(topics_.joint, "update_writer")};
  WriterTable<PeerId> reply_writers_{[this](const PeerId& peer) {
    return std::make_shared<Writer>(context(), *topics_.reply, reply_partition(peer),
                                    "call_writer");
  }};
  std::set<PeerId> there_;  // peers that were discovered and have not left; only for the worker

  std::unique_ptr<OwnedFilters> filters_;
  std::unique_ptr<Writer> presence_writer_;
  std::unique_ptr<Writer> directory_writer_;
  std::unique_ptr<Reader<wire::Request>> requests_;
  std::unique_ptr<Reader<wire::Update>> updates_;
  std::unique_ptr<Reader<wire::Joints>> joints_;
  std::unique_ptr<Reader<wire::Reply>> replies_;
  std::unique_ptr<Reader<wire::Page>> pages_;
  std::unique_ptr<Reader<wire::Presence>> presence_;
  std::optional<PushChannels> push_channels_;
  std::optional<Worker> worker_;
};

}  // namespace tfdude::fastdds
