#include "transport/fastdds/fastdds_transport.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/types/options.hpp"

#include "base/log.hpp"
#include "base/mutex.hpp"
#include "transport/fastdds/announcement.hpp"
#include "transport/fastdds/discovery_gate.hpp"
#include "transport/fastdds/discovery_server.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

constexpr std::chrono::seconds kLongLease{30};

// If so many announcements in a row are missing, their sender counts as lost. With 10 % packet loss
// that happens to a living one once in days, for a moment.
constexpr int kMissed = 6;

// Where the announcements of DDS are not heard, presence is repeated in their place.
constexpr std::chrono::milliseconds kRepeatEvery{800};
constexpr std::chrono::milliseconds kSilenceOfRepetition{2100};

// Discovery by a server takes several steps, each of which it may repeat after a second.
constexpr std::chrono::milliseconds kFirstSilenceByServer{8000};

// The number of servers that this one hears changes often just when there is most to do.
constexpr std::chrono::milliseconds kCountEvery{200};

constexpr std::uint32_t kMaxDomain = 232;  // beyond it the ports of RTPS 2.x run out

// How often a call that waits for an owner checks whether it still can come.
constexpr std::chrono::milliseconds kWaitStep{60};

// Time for the other participants to hear that this one ends.
constexpr std::chrono::milliseconds kLastWord{100};

// Of the type of Fast DDS, which has another name in each version.
template <class Duration>
std::chrono::nanoseconds nanoseconds_of(const Duration& duration) {
  return std::chrono::seconds(duration.seconds) + std::chrono::nanoseconds(duration.nanosec);
}

tl::unexpected<Error> not_created(const char* what) {
  return fail(Errc::kTransport, std::string("Fast DDS could not create ") + what);
}

}  // namespace

FastDdsTransport::FastDdsTransport(FastDdsOptions options)
    : options_(std::move(options)),
      counters_(options_.counters ? options_.counters : std::make_shared<FastDdsCounters>()) {}

Result<void> FastDdsTransport::start(TransportHandler& handler) {
  handler_ = &handler;
  auto profiles = Profiles::load(options_.profile);
  if (!profiles) return tl::unexpected(std::move(profiles.error()));
  profiles_ = *std::move(profiles);
  worker_.emplace();
  attention_.start(*worker_);
  if (auto created = create_participant(); !created) return created;
  if (auto created = create_endpoints(); !created) return created;
  worker_->repeat([this] { return keep_in_touch(); });
  return {};
}

Result<void> FastDdsTransport::create_participant() {
  edds::DomainParticipantQos qos = profiles_->participant();
  qos.name(participant_name(options_.partition));
  qos.user_data().data_vec(version_data());
  qos.properties().properties().emplace_back("fastdds.ignore_local_endpoints", "true");
  // Fast DDS 3 announces type descriptions that Cyclone DDS takes for types other than its own.
  // Without them, it compares only the names.
  qos.properties().properties().emplace_back("fastdds.type_propagation", "disabled");
  take_times(qos);
  if (!options_.discovery_server.empty()) {
    if (auto used = use_discovery_server(qos, options_.discovery_server); !used) return used;
  }
  DiscoveryGate discovery_gate(gate_, life_signs_);
  discovery_gate.prepare(qos, options_.domain, options_.partition.empty());
  participant_ = edds::DomainParticipantFactory::get_instance()->create_participant(
      options_.domain, qos, &participant_listener_, edds::StatusMask::none());
  if (participant_ == nullptr) {
    return fail(Errc::kTransport,
                "Fast DDS could not join domain " + std::to_string(options_.domain));
  }
  discovery_gate.open();
  self_ = peer_of(participant_->guid().guidPrefix);
  topics_.presence = create_topic(kPresenceTopic, edds::TypeSupport(new PresenceType));
  topics_.directory = create_topic(kDirectoryTopic, edds::TypeSupport(new PageType));
  topics_.reply = create_topic(kReplyTopic, edds::TypeSupport(new ReplyType));
  topics_.request = create_topic(kRequestTopic, edds::TypeSupport(new RequestType));
  topics_.update = create_topic(kUpdateTopic, edds::TypeSupport(new UpdateType));
  topics_.joint = create_topic(kJointTopic, edds::TypeSupport(new JointsType));
  topics_.state = create_topic(kStateTopic, edds::TypeSupport(new StateType));
  for (const auto* topic : {topics_.presence, topics_.directory, topics_.reply, topics_.request,
                            topics_.update, topics_.joint, topics_.state}) {
    if (topic == nullptr) return not_created("the topics");
  }
  return {};
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

edds::Topic* FastDdsTransport::create_topic(const char* name, const edds::TypeSupport& type) {
  if (!ok(type.register_type(participant_))) return nullptr;
  return participant_->create_topic(name, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
}

Result<void> FastDdsTransport::create_endpoints() {
  using Prefix = ertps::GuidPrefix_t;
  push_channels_.emplace(
      context(), *topics_.state,
      PushChannels::Calls{[this](const PushedValues& pushed) { handler_->on_pushed(pushed); },
                          [this](std::uint64_t group) { handler_->on_watcher(group); }});
  presence_ = std::make_unique<Reader<wire::Presence>>(
      context(), *topics_.presence, std::string(), "presence_reader",
      Reader<wire::Presence>::Calls{
          [this](const wire::Presence& sample, const Prefix& from) { take_presence(sample, from); },
          nullptr});
  pages_ = std::make_unique<Reader<wire::Page>>(
      context(), *topics_.directory, std::string(), "directory_reader",
      Reader<wire::Page>::Calls{
          [this](const wire::Page& sample, const Prefix& from) { take_page(sample, from); },
          nullptr});
  replies_ = std::make_unique<Reader<wire::Reply>>(
      context(), *topics_.reply, reply_partition(self_), "call_reader",
      Reader<wire::Reply>::Calls{[this](const wire::Reply& sample, const Prefix& from) {
                                   peers_.replied(from);
                                   take_reply(sample);
                                 },
                                 nullptr});
  if (!presence_->good() || !pages_->good() || !replies_->good()) {
    return not_created("the readers");
  }
  if (options_.partition.empty()) return {};
  presence_writer_ =
      std::make_unique<Writer>(context(), *topics_.presence, std::string(), "presence_writer");
  directory_writer_ =
      std::make_unique<Writer>(context(), *topics_.directory, std::string(), "directory_writer");
  if (!presence_writer_->good() || !directory_writer_->good()) {
    return not_created("the writers");
  }
  return {};
}

edds::ContentFilteredTopic* FastDdsTransport::create_filtered(edds::Topic* topic,
                                                              const std::string& partition) {
  return participant_->create_contentfilteredtopic(topic->get_name() + " of " + partition, topic,
                                                   partition, {}, OwnedFilters::kClassName);
}

Result<void> FastDdsTransport::serve(const std::string& partition) {
  using Prefix = ertps::GuidPrefix_t;
  filters_ = std::make_unique<OwnedFilters>(partition, *handler_, *counters_);
  if (!ok(participant_->register_content_filter_factory(OwnedFilters::kClassName,
                                                        filters_.get()))) {
    return not_created("the filter");
  }
  auto* requests = create_filtered(topics_.request, partition);
  auto* updates = create_filtered(topics_.update, partition);
  auto* joints = create_filtered(topics_.joint, partition);
  if (requests == nullptr || updates == nullptr || joints == nullptr)
    return not_created("the filtered topics");
  // A peer that matches our reader is going to ask: the writer for its replies is created while its
  // request is on the way.
  const auto asker_matched = [this](const Prefix& from, int change) {
    if (change > 0) worker_->post([this, peer = peer_of(from)] { open_reply_writer(peer); });
  };
  requests_ = std::make_unique<Reader<wire::Request>>(
      context(), *requests, partition, "call_reader",
      Reader<wire::Request>::Calls{
          [this](const wire::Request& sample, const Prefix& from) { take_request(sample, from); },
          asker_matched});
  updates_ = std::make_unique<Reader<wire::Update>>(
      context(), *updates, partition, "update_reader",
      Reader<wire::Update>::Calls{
          [this](const wire::Update& sample, const Prefix&) { take_update(sample); }, nullptr});
  joints_ = std::make_unique<Reader<wire::Joints>>(
      context(), *joints, partition, "update_reader",
      Reader<wire::Joints>::Calls{
          [this](const wire::Joints& sample, const Prefix&) { take_joints(sample); }, nullptr});
  const bool good = requests_->good() && updates_->good() && joints_->good();
  return good ? Result<void>() : not_created("the readers");
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
  requests_.reset();
  updates_.reset();
  joints_.reset();
  replies_.reset();
  pages_.reset();
  presence_.reset();
  push_channels_.reset();
  reply_writers_.clear();
  request_writers_.clear();
  update_writers_.clear();
  joint_writers_.clear();
  directory_writer_.reset();
  presence_writer_.reset();
  participant_->delete_contained_entities();
  edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  participant_ = nullptr;
}

// --- sending ---

void FastDdsTransport::announce(const Presence& presence) {
  const Lock lock(presence_mutex_);
  said_ = to_wire(presence);
  said_->peers(peers_.heard_count());
  said_at_ = Peers::Clock::now();
  presence_writer_->write(&*said_);
}

// Looks who is silent: often while this participant depends on others, or has news for them.
Milliseconds FastDdsTransport::keep_in_touch() {
  attention_.lower();
  const std::set<std::string> used = used_owners();
  std::set<std::string> needed;
  for (const std::string& partition : used) {
    // Who only sends a stream has none yet.
    const auto writer = request_writers_.open(partition);
    if (writer->good() && writer->matched()) needed.insert(partition);
  }
  for (const std::string& partition :
       peers_.look_for_silent(Peers::Clock::now(), next_look_, needed)) {
    probe(partition);
  }
  const bool up_to_date = announce_count();
  next_look_ = used.empty() && up_to_date ? Attention::kRarely : Attention::kOften;
  return next_look_;
}

// The partitions to which something was sent recently.
std::set<std::string> FastDdsTransport::used_owners() const {
  const auto since = Peers::Clock::now() - Attention::kDependsFor;
  std::set<std::string> owners;
  for (const auto* writers : {&request_writers_, &update_writers_, &joint_writers_}) {
    for (const auto& [partition, writer] : writers->all()) {
      if (writer->last_use() > since) owners.insert(partition);
    }
  }
  return owners;
}

void FastDdsTransport::probe(const std::string& partition) {
  wire::Request sample;
  sample.addressee(addressee_of(partition));
  sample.body().probe(0);
  request_writers_.open(partition)->write(&sample);
}

// A new participant knows by this number whether it has discovered all.
// @return false if others must be told later
bool FastDdsTransport::announce_count() {
  const auto heard = peers_.heard_count();
  const Lock lock(presence_mutex_);
  if (!said_) return true;
  const auto age = Peers::Clock::now() - said_at_;
  const bool changed = said_->peers() != heard;
  if (changed && age < kCountEvery) return false;
  if (!changed && (announced_by_dds_ || age < kRepeatEvery)) return true;
  said_->peers(heard);
  said_at_ = Peers::Clock::now();
  presence_writer_->write(&*said_);
  return true;
}

void FastDdsTransport::publish(const Page& page) {
  wire::Page sample = to_wire(page);
  if (!directory_writer_->write(&sample)) {
    log().error("page {} of partition {} could not be published", page.number, page.partition);
  }
}

WriterTable<std::string> FastDdsTransport::writers_of(edds::Topic*& topic, const char* profile) {
  return WriterTable<std::string>([this, &topic, profile](const std::string& partition) {
    return std::make_shared<Writer>(context(), *topic, partition, profile);
  });
}

void FastDdsTransport::prepare(const std::string& partition) {
  (void)request_writers_.open(partition);
}

Result<void> FastDdsTransport::send(const std::string& partition, const Request& request,
                                    Deadline deadline) {
  const auto to = request_writers_.open(partition);
  thread_local wire::Request sample;
  write_wire(request, partition, sample);
  return send(*to, partition, &sample, deadline);
}

Result<void> FastDdsTransport::send(const std::string& partition, const Update& update,
                                    Deadline deadline) {
  const auto to = update_writers_.open(partition);
  wire::Update sample = to_wire(update);
  return send(*to, partition, &sample, deadline);
}

Result<void> FastDdsTransport::send(const std::string& partition, const JointUpdate& update,
                                    Deadline deadline) {
  const auto to = joint_writers_.open(partition);
  wire::Joints sample = to_wire(update);
  return send(*to, partition, &sample, deadline);
}

Result<void> FastDdsTransport::send(Writer& writer, const std::string& partition, void* sample,
                                    Deadline deadline) {
  if (!writer.good()) return not_created("a writer");
  attention_.pay(writer);
  while (!writer.wait_until_matched(std::min(deadline, Peers::Clock::now() + kWaitStep))) {
    if (peers_.silent(partition)) {
      return fail(Errc::kUnreachable,
                  "partition " + quote(partition) + " left before it was discovered");
    }
    if (const std::string mismatch = writer.mismatch(); !mismatch.empty()) {
      return fail(Errc::kConfig, "partition " + quote(partition) + ": " + mismatch);
    }
    if (Peers::Clock::now() < deadline) continue;
    return fail(Errc::kTimeout, "partition " + quote(partition) +
                                    " was not discovered in time in domain " +
                                    std::to_string(options_.domain));
  }
  if (!writer.write(sample)) {
    return fail(Errc::kTimeout, "partition " + quote(partition) + " cannot be sent more data now");
  }
  return {};
}

Result<void> FastDdsTransport::flush(Deadline deadline) {
  auto streams = update_writers_.all();
  for (auto& stream : joint_writers_.all()) streams.push_back(std::move(stream));
  Result<void> outcome;
  for (const auto& [partition, stream] : streams) {
    // A silent peer is not waited for; what it has acknowledged before still counts.
    const bool silent = peers_.silent(partition);
    if (stream->flush(silent ? Deadline() : deadline) || !outcome) continue;
    outcome =
        fail(silent ? Errc::kUnreachable : Errc::kTimeout,
             "partition " + quote(partition) + " has not acknowledged all that was streamed to it");
  }
  return outcome;
}

// --- replying ---

// No writer is created for a peer that has left: nothing would delete it.
void FastDdsTransport::open_reply_writer(const PeerId& peer) {
  if (there_.count(peer) != 0) (void)reply_writers_.open(peer);
}

void FastDdsTransport::reply(const PeerId& to, const Reply& reply) {
  this->reply(to, to_wire(reply));
}

void FastDdsTransport::reply(const PeerId& to, wire::Reply sample) {
  if (const auto writer = reply_writers_.find(to)) {
    if (writer->good()) writer->write(&sample);
    return;
  }
  worker_->post([this, to, late = std::move(sample)]() mutable {
    open_reply_writer(to);
    const auto writer = reply_writers_.find(to);
    if (writer != nullptr && writer->good()) writer->write(&late);
  });
}

void FastDdsTransport::met(const ertps::GuidPrefix_t& prefix, const std::string& name,
                           const std::vector<std::uint8_t>& user_data) {
  const Announcement said = read_announcement(name, user_data);
  peers_.met(prefix, said);
  attention_.raise();
  if (!said.compatible()) return;
  worker_->post([this, peer = peer_of(prefix)] { there_.insert(peer); });
}

// A callback may still hold the writer. The worker then waits for it, so that the worker deletes
// it.
void FastDdsTransport::left(const ertps::GuidPrefix_t& prefix) {
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

void log_fastdds_to_standard_error() {
  using fastdds::edds::Log;
  Log::ClearConsumers();
  Log::RegisterConsumer(std::make_unique<fastdds::edds::StdoutErrConsumer>());
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
