#include "transport/fastdds/entities.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "transport/fastdds/peers.hpp"

namespace tfdude::fastdds {

// Each policy has one order, so who offers less than is requested has the lower value.
std::string mismatch_of(const std::string& topic, edds::QosPolicyId_t policy) {
  std::string values;
  if (policy == edds::RELIABILITY_QOS_POLICY_ID) {
    values = "reliability: a writer offers BEST_EFFORT, but a reader requests RELIABLE";
  } else if (policy == edds::DURABILITY_QOS_POLICY_ID) {
    values = "durability: a writer offers VOLATILE, but a reader requests TRANSIENT_LOCAL";
  } else {
    values = "policy number " + std::to_string(policy) + " of DDS";
  }
  return "topic " + topic + ", " + values + ". Use the same profile for all participants";
}

void log_mismatch(const std::string& mismatch) {
  static Mutex mutex;
  static auto& logged = *new std::set<std::string>;  // not destroyed: threads may outlive it
  const Lock lock(mutex);
  if (logged.insert(mismatch).second) log().error("{}", mismatch);
}

std::string endpoint_name(const char* kind, const std::string& topic,
                          const std::string& partition) {
  const std::string where = partition.empty() ? "the default one" : quote(partition);
  return std::string("the ") + kind + " of topic " + topic + " in DDS partition " + where;
}

void log_not_announced() { log().warn("Fast DDS did not announce an endpoint again"); }

Writer::Writer(const Context& context, edds::Topic& topic, const std::string& partition,
               const std::string& profile, std::function<void()> on_reader)
    : context_(context), on_reader_(std::move(on_reader)) {
  edds::PublisherQos qos = context.participant.get_default_publisher_qos();
  if (!partition.empty()) qos.partition().push_back(partition.c_str());
  const std::string name = endpoint_name("writer", topic.get_name(), partition);
  check_ =
      created("the publisher of " + name, [&] { return context.participant.create_publisher(qos); })
          .and_then([&](edds::Publisher* publisher) {
            publisher_ = publisher;
            return created(name, [&] {
              const Lock lock(endpoints_change());
              return publisher->create_datawriter(
                  &topic, context.profiles.writer(*publisher, profile), this);
            });
          })
          .map([&](edds::DataWriter* writer) { writer_ = writer; });
  if (!check_) return;
  ++context_.counters.writers;
  number_ = context.announced.writers.created([this] { announce_again(*writer_); });
  context.announced.all->created(entity_of(writer_->guid()));
}

Writer::~Writer() {
  context_.announced.writers.deleted(number_);
  if (writer_ != nullptr) context_.announced.all->deleted(entity_of(writer_->guid()));
  const Gate::Pause pause(context_.gate);
  const Lock lock(endpoints_change());
  if (writer_ != nullptr && ok(publisher_->delete_datawriter(writer_))) --context_.counters.writers;
  if (publisher_ != nullptr) context_.participant.delete_publisher(publisher_);
}

bool Writer::wait_until_matched(Deadline deadline) {
  Lock lock(mutex_);
  return matched_.wait_until(lock, deadline, [this] { return readers_ > 0; });
}

std::vector<PeerId> Writer::readers() const {
  const Lock lock(mutex_);
  std::vector<PeerId> readers;
  for (const auto& [reader, before_it] : readers_before_) readers.push_back(reader);
  return readers;
}

void Writer::wait_for_readers(Deadline deadline) {
  Lock lock(mutex_);
  const int before = readers_;
  matched_.wait_until(lock, deadline, [&] { return readers_ != before; });
}

bool Writer::write(void* sample) {
  if (!good()) return false;
  // Sequence numbers and source timestamps are assigned in the same order.
  const std::lock_guard lock(writing_);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  ertps::Time_t stamp;
  stamp.from_ns(source_stamp_.next(std::chrono::nanoseconds(now).count()));
  ertps::WriteParams params;
  params.source_timestamp(stamp);
  if (!fastdds::write(*writer_, sample, params)) return false;
  last_ = params.sample_identity().sequence_number().to64long();
  ++written_;
  return true;
}

bool Writer::flush(const Mark& mark, Deadline deadline,
                   const std::function<bool(const PeerId&)>& gone,
                   Acknowledgements* acknowledgements) {
  std::uint64_t before = acknowledged_;
  if (before >= mark.written) return true;
  std::multimap<PeerId, std::uint64_t> matched;
  {
    const Lock lock(mutex_);
    matched = readers_before_;
  }
  bool all = true;
  std::vector<PeerId> owing;
  for (const auto& [reader, before_it] : matched) {
    if (gone && gone(reader)) {
      all = false;
    } else if (before_it < mark.last) {
      owing.push_back(reader);
    }
  }
  // Perhaps nobody is left who could acknowledge it.
  const bool acknowledged =
      matched.empty() ||
      (all ? await_all(deadline) : await_some(mark, deadline, owing, *acknowledgements));
  if (!acknowledged) return false;
  // Another flush may have waited for more.
  while (before < mark.written && !acknowledged_.compare_exchange_weak(before, mark.written)) {
  }
  return true;
}

bool Writer::await_all(Deadline deadline) {
  // At most the longest time that DDS can represent.
  const Deadline now = Deadline::clock::now();
  const auto left =
      std::min(deadline, now + std::chrono::hours(24 * 365)) - std::min(now, deadline);
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(left);
  const auto rest = std::chrono::nanoseconds(left - seconds).count();
  return ok(writer_->wait_for_acknowledgments(
      {static_cast<std::int32_t>(seconds.count()), static_cast<std::uint32_t>(rest)}));
}

bool Writer::await_some(const Mark& mark, Deadline deadline, const std::vector<PeerId>& readers,
                        Acknowledgements& acknowledgements) const {
  Acknowledgements::WriterId id{};
  std::copy_n(writer_->guid().entityId.value, id.size(), id.begin());
  return std::all_of(readers.begin(), readers.end(), [&](const PeerId& reader) {
    return acknowledgements.wait_until(reader, id, mark.last, deadline);
  });
}

std::string Writer::mismatch() const {
  const Lock lock(mutex_);
  return mismatch_;
}

void Writer::on_offered_incompatible_qos(edds::DataWriter* writer,
                                         const edds::OfferedIncompatibleQosStatus& status) {
  std::string mismatch = mismatch_of(writer->get_topic()->get_name(), status.last_policy_id);
  log_mismatch(mismatch);
  const Lock lock(mutex_);
  mismatch_ = std::move(mismatch);
}

void Writer::on_publication_matched(edds::DataWriter*,
                                    const edds::PublicationMatchedStatus& status) {
  bool one_more = false;
  {
    const Lock lock(mutex_);
    const PeerId peer = peer_of(ertps::iHandle2GUID(status.last_subscription_handle).guidPrefix);
    if (status.current_count_change > 0) readers_before_.emplace(peer, last_);
    const auto left = readers_before_.find(peer);
    if (status.current_count_change < 0 && left != readers_before_.end())
      readers_before_.erase(left);
    one_more = status.current_count > readers_;
    if (readers_ == 0) matched_at_ = Deadline::clock::now();
    if (status.current_count == 0) replies_arrive_ = false;
    readers_ = status.current_count;
  }
  matched_.notify_all();
  if (one_more && on_reader_) on_reader_();
}

}  // namespace tfdude::fastdds
