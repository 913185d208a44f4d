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

// DDS repeats a lost discovery message after a second; discovery by a server takes more steps.
constexpr std::chrono::milliseconds kFirstBeat{1500};
constexpr std::chrono::milliseconds kFirstBeatByServer{8000};

constexpr std::uint32_t kMaxDomain = 232;  // beyond it the ports of RTPS 2.x run out

// Time for the other participants to hear that this one ends.
constexpr std::chrono::milliseconds kLastWord{100};

// If there are more servers than this, each sends its beat less often.
constexpr std::uint32_t kMany = 12;

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
  worker_->repeat(Peers::kSpeakEvery / 2, [this] { keep_in_touch(); });
  if (auto created = create_participant(); !created) return created;
  return create_endpoints();
}

Result<void> FastDdsTransport::create_participant() {
  edds::DomainParticipantQos qos = profiles_->participant();
  qos.name(participant_name(options_.partition));
  qos.user_data().data_vec(version_data());
  qos.properties().properties().emplace_back("fastdds.ignore_local_endpoints", "true");
  // Fast DDS 3 announces type descriptions that Cyclone DDS takes for types other than its own.
  // Without them, it compares only the names.
  qos.properties().properties().emplace_back("fastdds.type_propagation", "disabled");
  take_lease(qos);
  if (!options_.discovery_server.empty()) {
    if (auto used = use_discovery_server(qos, options_.discovery_server); !used) return used;
  }
  DiscoveryGate discovery_gate(gate_);
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
  topics_.beat = create_topic(kBeatTopic, edds::TypeSupport(new PresenceType));
  topics_.directory = create_topic(kDirectoryTopic, edds::TypeSupport(new PageType));
  topics_.reply = create_topic(kReplyTopic, edds::TypeSupport(new ReplyType));
  topics_.request = create_topic(kRequestTopic, edds::TypeSupport(new RequestType));
  topics_.update = create_topic(kUpdateTopic, edds::TypeSupport(new UpdateType));
  topics_.joint = create_topic(kJointTopic, edds::TypeSupport(new JointsType));
  topics_.state = create_topic(kStateTopic, edds::TypeSupport(new StateType));
  for (const auto* topic : {topics_.presence, topics_.beat, topics_.directory, topics_.reply,
                            topics_.request, topics_.update, topics_.joint, topics_.state}) {
    if (topic == nullptr) return not_created("the topics");
  }
  return {};
}

// The profile's lease is used only to detect loss here; DDS itself keeps a match for longer (see
// Peers).
void FastDdsTransport::take_lease(edds::DomainParticipantQos& qos) {
  auto& lease = qos.wire_protocol().builtin.discovery_config.leaseDuration;
  const auto silence =
      std::chrono::seconds(lease.seconds) + std::chrono::nanoseconds(lease.nanosec);
  const bool by_server = !options_.discovery_server.empty();
  peers_.configure(silence, by_server ? kFirstBeatByServer : kFirstBeat,
                   !options_.partition.empty());
  if (silence < kLongLease) lease = {static_cast<std::int32_t>(kLongLease.count()), 0};
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
      Reader<wire::Presence>::Calls{[this](const wire::Presence& sample, const Prefix& from) {
                                      take_presence(sample, from, false);
                                    },
                                    nullptr});
  beats_ = std::make_unique<Reader<wire::Presence>>(
      context(), *topics_.beat, std::string(), "beat_reader",
      Reader<wire::Presence>::Calls{[this](const wire::Presence& sample, const Prefix& from) {
                                      take_presence(sample, from, true);
                                    },
                                    nullptr});
  pages_ = std::make_unique<Reader<wire::Page>>(
      context(), *topics_.directory, std::string(), "directory_reader",
      Reader<wire::Page>::Calls{
          [this](const wire::Page& sample, const Prefix& from) { take_page(sample, from); },
          nullptr});
  replies_ = std::make_unique<Reader<wire::Reply>>(
      context(), *topics_.reply, reply_partition(self_), "call_reader",
      Reader<wire::Reply>::Calls{[this](const wire::Reply& sample, const Prefix& from) {
                                   peers_.heard(from);
                                   take_reply(sample);
                                 },
                                 nullptr});
  if (!presence_->good() || !beats_->good() || !pages_->good() || !replies_->good()) {
    return not_created("the readers");
  }
  if (options_.partition.empty()) return {};
  presence_writer_ =
      std::make_unique<Writer>(context(), *topics_.presence, std::string(), "presence_writer");
  beat_writer_ = std::make_unique<Writer>(context(), *topics_.beat, std::string(), "beat_writer");
  directory_writer_ =
      std::make_unique<Writer>(context(), *topics_.directory, std::string(), "directory_writer");
  if (!presence_writer_->good() || !beat_writer_->good() || !directory_writer_->good()) {
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
  beats_.reset();
  presence_.reset();
  push_channels_.reset();
  reply_writers_.clear();
  request_writers_.clear();
  update_writers_.clear();
  joint_writers_.clear();
  directory_writer_.reset();
  beat_writer_.reset();
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
  presence_writer_->write(&*said_);
}

// Each call checks who is silent. Every second call sends a beat, or every third among many
// participants, since the traffic of all beats grows with the square. A beat may be lost, as the
// next one follows. Only the beat says how many servers this one hears, because that number changes
// often just when there is most to do.
void FastDdsTransport::keep_in_touch() {
  peers_.look_for_silent(Peers::Clock::now());
  const auto heard = peers_.heard_count();
  const Lock lock(presence_mutex_);
  if (++looks_ < (heard > kMany ? 3 : 2)) return;
  looks_ = 0;
  if (!said_) return;
  said_->peers(heard);
  beat_writer_->write(&*said_);
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
                                    Deadline deadline) const {
  if (!writer.good()) return not_created("a writer");
  while (!writer.wait_until_matched(std::min(deadline, Peers::Clock::now() + Peers::kSpeakEvery))) {
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
  wire::Reply sample = to_wire(reply);
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
  if (!said.compatible()) return;
  worker_->post([this, peer = peer_of(prefix)] { there_.insert(peer); });
}

// A callback may still hold the writer. The worker then waits for it, so that the worker deletes
// it.
void FastDdsTransport::left(const ertps::GuidPrefix_t& prefix) {
  peers_.left(prefix);
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
