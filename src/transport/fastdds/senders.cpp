#include "transport/fastdds/senders.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/requests.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/stream_channel.hpp"

namespace tfdude::fastdds {
namespace {

// How often a call that waits for an owner checks whether it still can come.
constexpr std::chrono::milliseconds kWaitStep{60};

// An owner whose writer for replies is not discovered for so long after its reader is asked anyway.
constexpr std::chrono::milliseconds kReplyPathWithin{20};

}  // namespace

WriterTable<std::string> Senders::writers_of(edds::Topic* topic, const char* profile) const {
  return WriterTable<std::string>([this, topic, profile](const std::string& partition) {
    return std::make_shared<Writer>(parts_.context, *topic, partition, profile);
  });
}

void Senders::prepare(const std::string& partition, bool changes) {
  if (parts_.access.may_look()) (void)requests_.open(partition);
  if (changes && parts_.access.may_change(partition)) (void)changes_.open(partition);
}

Result<void> Senders::send(const std::string& partition, const Request& request,
                           Deadline deadline) {
  if (auto ok = parts_.access.check(partition, request); !ok) return ok;
  const auto to = (is_change(request) ? changes_ : requests_).open(partition);
  if (!to->replies_arrive()) {
    if (auto ok = await_match(*to, partition, deadline); !ok) return ok;
    if (!await_reply_path(*to, partition, deadline)) {
      return tl::unexpected(undiscovered(partition));
    }
    to->hear_replies();
  }
  thread_local wire::Request sample;
  write_wire(request, partition, sample);
  return send(*to, partition, &sample, deadline);
}

Result<void> Senders::send(const std::string& partition, const Update& update, Deadline deadline) {
  if (auto ok = parts_.access.check_stream(partition); !ok) return ok;
  wire::Update sample = to_wire(update);
  return send(*updates_.open(partition), partition, &sample, deadline);
}

Result<void> Senders::send(const std::string& partition, const JointUpdate& update,
                           Deadline deadline) {
  if (auto ok = parts_.access.check_stream(partition); !ok) return ok;
  wire::Joints sample = to_wire(update);
  return send(*joints_.open(partition), partition, &sample, deadline);
}

Error Senders::undiscovered(const std::string& partition) const {
  return {Errc::kTimeout, "partition " + quote(partition) +
                              " was not discovered in time in domain " +
                              std::to_string(parts_.domain)};
}

// A request whose reply would be dropped would have to be repeated.
// @return false at the deadline
bool Senders::await_reply_path(Writer& writer, const std::string& partition, Deadline deadline) {
  const auto latest = writer.matched_at() + kReplyPathWithin;
  return parts_.reply_paths.wait_until(partition, std::min(deadline, latest)) ||
         Peers::Clock::now() >= latest;
}

Result<void> Senders::send(Writer& writer, const std::string& partition, void* sample,
                           Deadline deadline) {
  if (auto ok = await_match(writer, partition, deadline); !ok) return ok;
  if (!writer.write(sample)) {
    return fail(Errc::kTimeout, "partition " + quote(partition) + " cannot be sent more data now");
  }
  return {};
}

Result<void> Senders::await_match(Writer& writer, const std::string& partition, Deadline deadline) {
  if (!writer.good()) return writer.check();
  parts_.attention.pay(writer);
  const auto step = [deadline] { return std::min(deadline, Peers::Clock::now() + kWaitStep); };
  // What a former process alone would get would be lost. A later one may have sent its frames
  // before it says that it serves.
  const auto reaches = [&] {
    if (!writer.wait_until_matched(step())) return false;
    if (!parts_.peers.any_silent()) return true;
    const auto readers = writer.readers();
    const auto is_silent = [&](const PeerId& peer) { return parts_.peers.silent(peer); };
    if (!std::all_of(readers.begin(), readers.end(), is_silent)) return true;
    writer.wait_for_readers(step());
    return false;
  };
  while (!reaches()) {
    if (parts_.peers.silent(partition)) {
      return fail(Errc::kUnreachable,
                  "partition " + quote(partition) + " left before it was discovered");
    }
    if (const std::string mismatch = writer.mismatch(); !mismatch.empty()) {
      return fail(Errc::kConfig, "partition " + quote(partition) + ": " + mismatch);
    }
    if (Peers::Clock::now() >= deadline) return tl::unexpected(undiscovered(partition));
  }
  return {};
}

template <class Message, class Sample>
std::unique_ptr<Channel<Message>> Senders::channel(WriterTable<std::string>& writers,
                                                   const std::string& partition) {
  const bool may = parts_.access.check_stream(partition).has_value();
  return std::make_unique<StreamChannel<Message, Sample>>(may ? writers.open(partition) : nullptr,
                                                          parts_.attention);
}

std::unique_ptr<Channel<Update>> Senders::update_channel(const std::string& partition) {
  return channel<Update, wire::Update>(updates_, partition);
}

std::unique_ptr<Channel<JointUpdate>> Senders::joint_channel(const std::string& partition) {
  return channel<JointUpdate, wire::Joints>(joints_, partition);
}

Result<void> Senders::flush(Deadline deadline) {
  auto streams = updates_.all();
  for (auto& stream : joints_.all()) streams.push_back(std::move(stream));
  Result<void> outcome;
  for (const auto& [partition, stream] : streams) {
    if (auto flushed = flush(*stream, partition, deadline); !flushed && outcome) {
      outcome = std::move(flushed);
    }
  }
  return outcome;
}

// Checks the owner repeatedly, because it may be lost, or return, meanwhile.
Result<void> Senders::flush(Writer& stream, const std::string& partition, Deadline deadline) {
  const Writer::Mark mark = stream.mark();  // what is written meanwhile is left to the next flush
  const auto gone = [this](const PeerId& peer) {
    const bool replaced = parts_.peers.replaced(peer);
    // Acknowledgements cannot be read then, so Fast DDS must wait for the others only.
    if (replaced && parts_.access.encrypts()) parts_.farewells.say_for(peer);
    return replaced;
  };
  while (true) {
    // A silent peer is not waited for; what it has acknowledged before still counts.
    const bool silent = parts_.peers.silent(partition);
    const auto now = Peers::Clock::now();
    const Deadline step = silent ? Deadline() : std::min(deadline, now + kWaitStep);
    if (stream.flush(mark, step, gone, &parts_.acknowledgements)) return {};
    if (silent || now >= deadline) {
      return fail(
          silent ? Errc::kUnreachable : Errc::kTimeout,
          "partition " + quote(partition) + " has not acknowledged all that was streamed to it");
    }
  }
}

std::set<std::string> Senders::used_owners() const {
  const auto since = Peers::Clock::now() - Attention::kDependsFor;
  std::set<std::string> owners;
  for (const auto* writers : {&requests_, &changes_, &updates_, &joints_}) {
    for (const auto& [partition, writer] : writers->all()) {
      if (writer->last_use() > since) owners.insert(partition);
    }
  }
  return owners;
}

std::set<std::string> Senders::askable(const std::set<std::string>& partitions) {
  std::set<std::string> askable;
  if (!parts_.access.may_look()) return askable;
  for (const std::string& partition : partitions) {
    // A client that only sends streams has no writer yet.
    const auto writer = requests_.open(partition);
    if (writer->matched()) askable.insert(partition);
  }
  return askable;
}

void Senders::probe(const std::string& partition) {
  wire::Request sample;
  sample.addressee(addressee_of(partition));
  sample.body().probe(0);
  requests_.open(partition)->write(&sample);
}

}  // namespace tfdude::fastdds
