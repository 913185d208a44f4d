#include "transport/fastdds/fastdds_transport.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/types/options.hpp"

#include "base/log.hpp"
#include "base/mutex.hpp"
#include "base/token_bucket.hpp"
#include "transport/fastdds/announcement.hpp"
#include "transport/fastdds/discovery_server.hpp"
#include "transport/fastdds/topics.hpp"
#include "transport/network.hpp"

namespace tfdude::fastdds {
namespace {

constexpr std::chrono::seconds kLongLease{30};

// If so many announcements in a row are missing, their sender counts as lost. With 10 % packet loss
// that happens to a living one once in days, for a moment.
constexpr int kMissed = 6;

// Where the announcements of DDS are not heard, presence is repeated in their place (Contact).
constexpr std::chrono::milliseconds kSilenceOfRepetition{2100};

// Discovery by a server takes several steps, each of which it may repeat after a second.
constexpr std::chrono::milliseconds kFirstSilenceByServer{8000};

// The DDS partition of a reader that reads what all owners write.
constexpr const char* kAllOwners = "*";

constexpr std::uint32_t kMaxDomain = 232;  // beyond it the ports of RTPS 2.x run out

// Time for the other participants to hear that this one ends.
constexpr std::chrono::milliseconds kLastWord{100};

// Of the type of Fast DDS, which has another name in each version.
template <class Duration>
std::chrono::nanoseconds nanoseconds_of(const Duration& duration) {
  return std::chrono::seconds(duration.seconds) + std::chrono::nanoseconds(duration.nanosec);
}

}  // namespace

FastDdsTransport::FastDdsTransport(FastDdsOptions options)
    : options_(std::move(options)),
      counters_(options_.counters ? options_.counters : std::make_shared<FastDdsCounters>()),
      guard_(std::make_shared<DatagramGuard>(!options_.keys.empty())) {}

Result<void> FastDdsTransport::start(TransportHandler& handler) {
  handler_ = &handler;
  auto profiles = Profiles::load(options_.profile);
  if (!profiles) return tl::unexpected(std::move(profiles.error()));
  profiles_ = *std::move(profiles);
  auto access = Access::read(options_.keys, options_.partition);
  if (!access) return tl::unexpected(std::move(access.error()));
  access_ = *std::move(access);
  admission_.configure(access_.authority());
  worker_.emplace();
  if (auto begun = worker_->begin(); !begun) return begun;
  if (auto spare = threads_to_spare(); !spare) return spare;
  attention_.start(*worker_);
  if (auto created = create_participant(); !created) return created;
  if (auto created = create_endpoints(); !created) return created;
  worker_->repeat([this] {
    announced_.writers.tidy();
    announced_.readers.tidy();
    return contact_->look();
  });
  return {};
}

Result<void> FastDdsTransport::create_participant() {
  edds::DomainParticipantQos qos = profiles_->participant();
  qos.name(participant_name(options_.partition));
  qos.user_data().data_vec(user_data(access_.authority()));
  access_.secure(qos);
  qos.properties().properties().emplace_back("fastdds.ignore_local_endpoints", "true");
  // Fast DDS 3 announces type descriptions that Cyclone DDS takes for types other than its own.
  // Without them, it compares only the names.
  qos.properties().properties().emplace_back("fastdds.type_propagation", "disabled");
  take_times(qos);
  if (!options_.discovery_server.empty()) {
    if (auto used = use_discovery_server(qos, options_.discovery_server); !used) return used;
  }
  // The time may be published by a client.
  const bool owners_only = options_.partition.empty() && !handler_->wants_clock();
  discovery_gate_.prepare(qos, options_.domain, owners_only);
  const auto joined = created("a participant in domain " + std::to_string(options_.domain), [&] {
    return edds::DomainParticipantFactory::get_instance()->create_participant(
        options_.domain, qos, &participant_listener_, edds::StatusMask::none());
  });
  if (!joined) return tl::unexpected(joined.error());
  participant_ = *joined;
  if (auto heard = discovery_gate_.check(); !heard) return heard;
  discovery_gate_.open();
  self_ = peer_of(participant_->guid().guidPrefix);
  return create_topics(*participant_, counters_, topics_);
}

// The profile's lease is used only to detect loss here; DDS itself keeps a match for longer (see
// Peers).
void FastDdsTransport::take_times(edds::DomainParticipantQos& qos) {
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  const auto lease = nanoseconds_of(discovery.leaseDuration);
  const auto every = nanoseconds_of(discovery.leaseDuration_announcementperiod);
  announced_by_dds_ = options_.discovery_server.empty() && DiscoveryGate::hears_announcements(qos);
  Patience patience{lease, kSilenceOfRepetition, {}, Attention::kRarely};
  if (announced_by_dds_) patience.others = every * kMissed + every / 4;
  if (!options_.discovery_server.empty()) patience.first = kFirstSilenceByServer;
  peers_.configure(patience, !options_.partition.empty());
  if (lease < kLongLease) {
    discovery.leaseDuration = {static_cast<std::int32_t>(kLongLease.count()), 0};
  }
}

Result<void> FastDdsTransport::create_endpoints() {
  using Info = edds::SampleInfo;
  senders_.emplace(Senders::Parts{context(), topics_, peers_, attention_, access_, reply_paths_,
                                  *acknowledgements_, *farewells_, options_.domain});
  contact_.emplace(peers_, attention_, *senders_, !announced_by_dds_);
  push_channels_.emplace(
      context(), *topics_.state, options_.partition,
      PushChannels::Calls{[this](const PushedValues& pushed) { handler_->on_pushed(pushed); },
                          [this](std::uint64_t group) { handler_->on_watcher(group); }});
  std::function<void(Time)> on_clock;
  if (handler_->wants_clock()) on_clock = [this](Time now) { handler_->on_clock(now); };
  clock_.emplace(context(), *topics_.clock, std::move(on_clock));
  presence_ = std::make_unique<Reader<wire::Presence>>(
      context(), *topics_.presence, kAllOwners, "presence_reader",
      Reader<wire::Presence>::Calls{[this](const wire::Presence& sample, const Info& info) {
                                      take_presence(sample, writer_of(info));
                                    },
                                    nullptr});
  if (handler_->wants_pages()) {
    pages_ = std::make_unique<Reader<wire::Page>>(
        context(), *topics_.directory, kAllOwners, "directory_reader",
        Reader<wire::Page>::Calls{[this](const wire::Page& sample, const Info& info) {
                                    take_page(sample, writer_of(info));
                                  },
                                  nullptr});
  }
  if (access_.may_look()) read_replies();
  if (!presence_->check()) return presence_->check();
  if (pages_ != nullptr && !pages_->check()) return pages_->check();
  if (replies_ != nullptr && !replies_->check()) return replies_->check();
  if (auto clock = clock_->check(); !clock) return clock;
  const std::string& own = options_.partition;
  if (own.empty()) return {};
  presence_writer_ = std::make_unique<Writer>(context(), *topics_.presence, own, "presence_writer");
  directory_writer_ =
      std::make_unique<Writer>(context(), *topics_.directory, own, "directory_writer");
  return presence_writer_->check() ? directory_writer_->check() : presence_writer_->check();
}

void FastDdsTransport::read_replies() {
  using Info = edds::SampleInfo;
  replies_ = std::make_unique<Reader<wire::Reply>>(
      context(), *topics_.reply, reply_partition(kAllOwners, self_), "call_reader",
      Reader<wire::Reply>::Calls{
          [this](const wire::Reply& sample, const Info& info) { take_reply(sample, info); },
          [this](const ertps::GUID_t& writer, int change) {
            if (change <= 0) return reply_paths_.closed(writer);
            reply_paths_.opened(writer, owner_of_replies(writer_partitions_.of(writer)));
          }});
}

Result<edds::ContentFilteredTopic*> FastDdsTransport::create_filtered(
    edds::Topic* topic, const std::string& partition) {
  const std::string name = topic->get_name() + " of " + partition;
  return created("the filtered topic " + name, [&] {
    return participant_->create_contentfilteredtopic(name, topic, partition, {},
                                                     OwnedFilters::kClassName);
  });
}

// A peer that matches our reader is going to ask: the writer for its replies is created while its
// request is on the way.
Result<void> FastDdsTransport::read_requests(std::unique_ptr<Reader<wire::Request>>& reader,
                                             edds::Topic* topic, const std::string& partition,
                                             bool may_change) {
  const auto filtered = create_filtered(topic, partition);
  if (!filtered) return tl::unexpected(filtered.error());
  using Requests = Reader<wire::Request>;
  reader = std::make_unique<Requests>(
      context(), **filtered, partition, "call_reader",
      Requests::Calls{
          [this, may_change](const wire::Request& sample, const edds::SampleInfo& info) {
            take_request(sample, writer_of(info).guidPrefix, may_change);
          },
          [this](const ertps::GUID_t& from, int change) {
            if (change <= 0) return;
            worker_->post([this, peer = peer_of(from.guidPrefix)] { open_reply_writer(peer); });
          }});
  return reader->check();
}

Result<void> FastDdsTransport::serve(const std::string& partition) {
  using Info = edds::SampleInfo;
  peers_.serve(partition);
  filters_ = std::make_unique<OwnedFilters>(partition, *handler_, *counters_);
  const auto filters = created("the filters of partition " + quote(partition), [&] {
    const bool known =
        ok(participant_->register_content_filter_factory(OwnedFilters::kClassName, filters_.get()));
    return known ? filters_.get() : nullptr;
  });
  if (!filters) return tl::unexpected(filters.error());
  if (auto requests = read_requests(requests_, topics_.request, partition, false); !requests) {
    return requests;
  }
  if (auto changes = read_requests(changes_, topics_.change, partition, true); !changes) {
    return changes;
  }
  const auto updates = create_filtered(topics_.update, partition);
  if (!updates) return tl::unexpected(updates.error());
  updates_ = std::make_unique<Reader<wire::Update>>(
      context(), **updates, partition, "update_reader",
      Reader<wire::Update>::Calls{
          [this](const wire::Update& sample, const Info&) { take_update(sample); }, nullptr});
  if (!updates_->check() || !handler_->owns_joints()) return updates_->check();
  const auto joints = create_filtered(topics_.joint, partition);
  if (!joints) return tl::unexpected(joints.error());
  joints_ = std::make_unique<Reader<wire::Joints>>(
      context(), **joints, partition, "update_reader",
      Reader<wire::Joints>::Calls{
          [this](const wire::Joints& sample, const Info&) { take_joints(sample); }, nullptr});
  return joints_->check();
}

std::string FastDdsTransport::network() const {
  const bool plain = options_.keys.empty() && options_.discovery_server.empty();
  return plain ? network_of(options_.domain, options_.profile) : std::string();
}

// A discovery server forwards several times per second, one step of the discovery at a time.
Milliseconds FastDdsTransport::discovery_time() const {
  return Milliseconds(options_.discovery_server.empty() ? 400 : 1500);
}

void FastDdsTransport::stop() {
  if (participant_ == nullptr) return;
  if (presence_writer_ != nullptr) {
    (void)presence_writer_->flush(std::chrono::steady_clock::now() + kLastWord);
  }
  // From here on nothing is matched while endpoints are deleted (see Gate). Then the worker that
  // creates and deletes them stops, too.
  gate_->close();
  worker_->stop();
  participant_->set_listener(nullptr);
  // A server of discovery has to be told of each endpoint.
  if (options_.discovery_server.empty()) discovery_gate_.close();
  requests_.reset();
  changes_.reset();
  updates_.reset();
  joints_.reset();
  replies_.reset();
  pages_.reset();
  presence_.reset();
  push_channels_.reset();
  clock_.reset();
  reply_writers_.clear();
  senders_.reset();
  directory_writer_.reset();
  presence_writer_.reset();
  participant_->delete_contained_entities();
  discovery_gate_.open();
  edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  participant_ = nullptr;
}

// --- sending ---

// Both writers at once, whichever is needed now: one that is created later may not be discovered,
// for instance while a discovery server cannot be reached. But a client that asks for its frames
// mostly comes with one question.
void FastDdsTransport::prepare(const std::string& partition) {
  senders_->prepare(partition, handler_->wants_pages() || !options_.discovery_server.empty());
}

void FastDdsTransport::announce(const Presence& presence) {
  contact_->announce(*presence_writer_, presence);
}

void FastDdsTransport::publish(const Page& page) {
  wire::Page sample = to_wire(page);
  if (!directory_writer_->write(&sample)) {
    log().error("page {} of partition {} could not be published", page.number, page.partition);
  }
}

Result<void> FastDdsTransport::watch(const std::string& owner, std::uint64_t group) {
  if (auto ok = access_.check_watch(owner); !ok) return ok;
  return push_channels_->watch(owner, group);
}

Result<void> FastDdsTransport::publish_clock(Time now) {
  if (auto ok = access_.check_clock(); !ok) return ok;
  return clock_->publish(now);
}

// --- replying ---

// No writer is created for a peer that has left: nothing would delete it.
void FastDdsTransport::open_reply_writer(const PeerId& peer) {
  if (there_.count(peer) == 0) return;
  const auto writer = reply_writers_.open(peer);
  if (!writer->good()) log_not_created("no replies are sent", writer->check().error());
}

void FastDdsTransport::reply(const PeerId& to, const Reply& reply) {
  thread_local wire::Reply sample;  // kept, for its memory
  write_wire(reply, sample);
  this->reply(to, sample);
}

void FastDdsTransport::reply(const PeerId& to, wire::Reply& sample) {
  if (const auto writer = reply_writers_.find(to)) {
    writer->write(&sample);
    return;
  }
  worker_->post([this, to, late = sample]() mutable {
    open_reply_writer(to);
    if (const auto writer = reply_writers_.find(to)) writer->write(&late);
  });
}

void FastDdsTransport::met(const ertps::GuidPrefix_t& prefix, const std::string& name,
                           const std::vector<std::uint8_t>& user_data) {
  announced_.all->found(peer_of(prefix));
  admission_.discovered(peer_of(prefix), read_announcement(name, user_data));
}

// A forged announcement may have come before the true one.
void FastDdsTransport::changed(const ertps::GuidPrefix_t& prefix, const std::string& name,
                               const std::vector<std::uint8_t>& user_data) {
  if (!peers_.is_incompatible(prefix)) return;
  const Announcement said = read_announcement(name, user_data);
  if (said.compatible()) admission_.discovered(peer_of(prefix), said);
}

void FastDdsTransport::writer_found(const ertps::GUID_t& writer, const std::string& topic,
                                    const std::vector<std::string>& partitions) {
  writer_partitions_.found(writer, partitions);
  if (topic != kDirectoryTopic && topic != kPresenceTopic) return;
  windows_->follow(peer_of(writer.guidPrefix), entity_of(writer));
}

void FastDdsTransport::authenticated(const ertps::GuidPrefix_t& prefix, bool verified) {
  if (verified) guard_->verified(peer_of(prefix));
  admission_.authenticated(peer_of(prefix), verified);
}

void FastDdsTransport::admit(const PeerId& peer, const Announcement& said) {
  peers_.met(peer, said);
  attention_.raise();
  if (!said.compatible()) return;
  worker_->post([this, peer] { there_.insert(peer); });
}

// A callback may still hold the writer. The worker then waits for it, so that the worker deletes
// it.
void FastDdsTransport::left(const ertps::GuidPrefix_t& prefix) {
  guard_->left(peer_of(prefix));
  if (announced_.all->left(peer_of(prefix))) return;
  admission_.left(peer_of(prefix));
  peers_.left(prefix);
  attention_.raise();
  worker_->post([this, peer = peer_of(prefix)] {
    there_.erase(peer);
    const auto writer = reply_writers_.take(peer);
    while (writer.use_count() > 1) std::this_thread::yield();
  });
}

}  // namespace tfdude::fastdds

namespace tfdude {

namespace {

// What strangers send must not fill a disk with what Fast DDS says of it.
class BoundedConsumer final : public fastdds::edds::StdoutErrConsumer {
 public:
  void Consume(const fastdds::edds::Log::Entry& entry) override {
    if (lines_.take(TokenBucket::Clock::now())) StdoutErrConsumer::Consume(entry);
  }

 private:
  TokenBucket lines_{10, 1000};
};

}  // namespace

void log_fastdds_to_standard_error() {
  using fastdds::edds::Log;
  Log::ClearConsumers();
  Log::RegisterConsumer(std::make_unique<BoundedConsumer>());
}

Result<TransportPtr> make_fastdds_transport(const FastDdsOptions& options) {
  if (options.domain > fastdds::kMaxDomain) {
    const bool unread = options.domain == kNoDomain;
    return fail(Errc::kInvalidInput,
                (unread ? "TFDUDE_DOMAIN" : "domain " + std::to_string(options.domain)) +
                    " is not a number within 0 to " + std::to_string(fastdds::kMaxDomain));
  }
  if (!options.discovery_server.empty()) {
    if (auto good = check_discovery_server(options.discovery_server); !good) {
      return tl::unexpected(std::move(good.error()));
    }
  }
  return std::make_unique<fastdds::FastDdsTransport>(options);
}

}  // namespace tfdude
