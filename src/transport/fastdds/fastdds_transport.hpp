#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/transport/fastdds.hpp"

#include "base/mutex.hpp"
#include "transport/fastdds/access.hpp"
#include "transport/fastdds/acknowledgements.hpp"
#include "transport/fastdds/admission.hpp"
#include "transport/fastdds/attention.hpp"
#include "transport/fastdds/clock_channel.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/contact.hpp"
#include "transport/fastdds/discovery_gate.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/fair_share.hpp"
#include "transport/fastdds/owned_filter.hpp"
#include "transport/fastdds/peers.hpp"
#include "transport/fastdds/push_channels.hpp"
#include "transport/fastdds/reply_paths.hpp"
#include "transport/fastdds/senders.hpp"
#include "transport/fastdds/topics.hpp"
#include "transport/fastdds/worker.hpp"
#include "transport/fastdds/writer_partitions.hpp"
#include "transport/fastdds/writer_table.hpp"
#include "transport/port.hpp"

namespace tfdude::fastdds {

/// What is sent to or by the owner of partition P is in the DDS partition P, but replies are in
/// P/PEER and pushed values in P/GROUP. A sender keeps a writer for each owner, and an owner one
/// for each peer, so messages reach only those concerned. Presence and structure are read from all.
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
                    Deadline deadline) override {
    return senders_->send(partition, request, deadline);
  }
  Result<void> send(const std::string& partition, const Update& update,
                    Deadline deadline) override {
    return senders_->send(partition, update, deadline);
  }
  Result<void> send(const std::string& partition, const JointUpdate& update,
                    Deadline deadline) override {
    return senders_->send(partition, update, deadline);
  }
  std::unique_ptr<Channel<Update>> update_channel(const std::string& partition) override {
    return senders_->update_channel(partition);
  }
  std::unique_ptr<Channel<JointUpdate>> joint_channel(const std::string& partition) override {
    return senders_->joint_channel(partition);
  }
  Result<void> flush(Deadline deadline) override {
    return senders_ ? senders_->flush(deadline) : Result<void>();  // also if it did not start
  }
  void reply(const PeerId& to, const Reply& reply) override;
  Result<void> watch(const std::string& owner, std::uint64_t group) override;
  void unwatch(std::uint64_t group) override { push_channels_->unwatch(group); }
  void push(const PushedValues& pushed) override { push_channels_->push(pushed); }
  void end_pushing(std::uint64_t group) override { push_channels_->end_pushing(group); }
  Result<void> publish_clock(Time now) override;
  bool discovered() const override {
    return !admission_.awaits_authentication() && peers_.discovered(admission_.excluded().size());
  }
  bool awaits_presence() const override {
    return admission_.awaits_authentication() || peers_.awaits_presence();
  }
  std::vector<std::string> excluded() const override { return admission_.excluded(); }
  std::uint64_t dropped() const override { return fair_share_->dropped(); }
  std::uint64_t refused_datagrams() const override { return guard_->refused(); }
  std::chrono::nanoseconds busy_for() const override { return gate_->busy_for(Gate::Clock::now()); }
  std::vector<IncompatiblePeer> incompatible() const override { return peers_.incompatible(); }
  std::string network() const override;
  bool heard_lately(const std::string& partition) const override {
    return peers_.heard_lately(partition);
  }
  Milliseconds discovery_time() const override;

  // Of ParticipantListener, from a thread of the library.
  void met(const ertps::GuidPrefix_t& prefix, const std::string& name,
           const std::vector<std::uint8_t>& user_data);
  void changed(const ertps::GuidPrefix_t& prefix, const std::string& name,
               const std::vector<std::uint8_t>& user_data);
  void left(const ertps::GuidPrefix_t& prefix);
  void authenticated(const ertps::GuidPrefix_t& prefix, bool verified);
  void writer_found(const ertps::GUID_t& writer, const std::string& topic,
                    const std::vector<std::string>& partitions);
  void writer_lost(const ertps::GUID_t& writer) {
    writer_partitions_.lost(writer);
    windows_->forget(peer_of(writer.guidPrefix), entity_of(writer));
  }
  void endpoint_found(const ertps::GUID_t& endpoint, std::uint64_t settings) {
    announced_.all->found(peer_of(endpoint.guidPrefix), entity_of(endpoint), settings);
  }
  void endpoint_lost(const ertps::GUID_t& endpoint) {
    announced_.all->lost(peer_of(endpoint.guidPrefix), entity_of(endpoint));
  }

 private:
  Result<void> create_participant();
  Result<void> create_endpoints();
  void read_replies();
  void take_times(edds::DomainParticipantQos& qos);
  Result<edds::ContentFilteredTopic*> create_filtered(edds::Topic* topic,
                                                      const std::string& partition);
  Result<void> read_requests(std::unique_ptr<Reader<wire::Request>>& reader, edds::Topic* topic,
                             const std::string& partition, bool may_change);
  [[nodiscard]] Context context() {
    return {*participant_, *profiles_, *gate_, *counters_, announced_};
  }
  void open_reply_writer(const PeerId& peer);
  void reply(const PeerId& to, wire::Reply& sample);

  void admit(const PeerId& peer, const Announcement& said);
  void take_request(const wire::Request& sample, const ertps::GuidPrefix_t& from, bool may_change);
  void take_update(const wire::Update& sample);
  void take_joints(const wire::Joints& sample);
  void take_reply(const wire::Reply& sample, const edds::SampleInfo& info);
  void take_page(const wire::Page& sample, const ertps::GUID_t& writer);
  void take_presence(const wire::Presence& sample, const ertps::GUID_t& writer);
  [[nodiscard]] bool ignores(const ertps::GUID_t& writer) const;
  [[nodiscard]] bool is_of(const std::string& partition, const ertps::GUID_t& writer,
                           const char* topic) const;

  const FastDdsOptions options_;
  const std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  std::optional<Profiles> profiles_;
  const std::shared_ptr<FastDdsCounters> counters_;
  TransportHandler* handler_ = nullptr;
  const std::shared_ptr<LifeSigns> life_signs_ = std::make_shared<LifeSigns>();
  const std::shared_ptr<Acknowledgements> acknowledgements_ = std::make_shared<Acknowledgements>();
  const std::shared_ptr<DatagramGuard> guard_;
  const std::shared_ptr<FairShare> fair_share_ = std::make_shared<FairShare>();
  const std::shared_ptr<Farewells> farewells_ = std::make_shared<Farewells>();
  Announced announced_;
  const std::shared_ptr<SampleWindows> windows_ = std::make_shared<SampleWindows>();
  DiscoveryGate discovery_gate_{gate_,       life_signs_, acknowledgements_, guard_,
                                fair_share_, farewells_,  announced_.all,    windows_};
  Peers peers_{life_signs_, [this](const Presence& presence) { handler_->on_presence(presence); },
               [this](const Presence& presence, std::chrono::nanoseconds early) {
                 handler_->on_lost(presence.partition, presence.incarnation, early);
               }};

  ParticipantListener<FastDdsTransport> participant_listener_{*this};
  edds::DomainParticipant* participant_ = nullptr;
  PeerId self_{};
  Topics topics_;

  Access access_;
  Admission admission_{[this](const PeerId& peer, const Announcement& said) { admit(peer, said); }};
  WriterPartitions writer_partitions_;
  ReplyPaths reply_paths_;
  Attention attention_;
  bool announced_by_dds_ = true;  // participants hear the announcements of DDS; set at the start
  std::optional<Senders> senders_;
  std::optional<Contact> contact_;

  WriterTable<PeerId> reply_writers_{[this](const PeerId& peer) {
    return std::make_shared<Writer>(context(), *topics_.reply,
                                    reply_partition(options_.partition, peer), "call_writer");
  }};
  std::set<PeerId> there_;  // peers that were discovered and have not left; only for the worker

  std::unique_ptr<OwnedFilters> filters_;
  std::unique_ptr<Writer> presence_writer_;
  std::unique_ptr<Writer> directory_writer_;
  std::unique_ptr<Reader<wire::Request>> requests_;
  std::unique_ptr<Reader<wire::Request>> changes_;
  std::unique_ptr<Reader<wire::Update>> updates_;
  std::unique_ptr<Reader<wire::Joints>> joints_;
  std::unique_ptr<Reader<wire::Reply>> replies_;
  std::unique_ptr<Reader<wire::Page>> pages_;
  std::unique_ptr<Reader<wire::Presence>> presence_;
  std::optional<PushChannels> push_channels_;
  std::optional<ClockChannel> clock_;
  std::optional<Worker> worker_;
};

}  // namespace tfdude::fastdds
