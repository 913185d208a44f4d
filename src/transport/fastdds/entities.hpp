#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/transport/fastdds.hpp"

#include "base/mutex.hpp"
#include "transport/fastdds/acknowledgements.hpp"
#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/creation.hpp"
#include "transport/fastdds/endpoint_numbers.hpp"
#include "transport/fastdds/gate.hpp"
#include "transport/fastdds/growing_stamp.hpp"
#include "transport/fastdds/profiles.hpp"

// DDS entities with a lifetime. One that the library could not create is null inside: see check().
namespace tfdude::fastdds {

using Deadline = std::chrono::steady_clock::time_point;

/// What the entities of one participant are made with.
struct Context {
  edds::DomainParticipant& participant;
  const Profiles& profiles;
  Gate& gate;  ///< shut while one of them is deleted, so that none may be in a callback
  FastDdsCounters& counters;
  Announced& announced;
};

void log_not_announced();

/// Names a writer or reader for errors.
[[nodiscard]] std::string endpoint_name(const char* kind, const std::string& topic,
                                        const std::string& partition);

/// Gives an endpoint that exists other user data, so that DDS announces it again.
template <class Endpoint>
void announce_again(Endpoint& endpoint) {
  auto qos = endpoint.get_qos();
  auto& data = qos.user_data();
  data.data_vec(data.empty() ? std::vector<std::uint8_t>{1} : std::vector<std::uint8_t>());
  if (!ok(endpoint.set_qos(qos))) log_not_announced();
}

/// The part of an endpoint's GUID that is its own.
[[nodiscard]] inline EndpointSets::Entity entity_of(const ertps::GUID_t& endpoint) {
  EndpointSets::Entity entity{};
  std::copy_n(endpoint.entityId.value, entity.size(), entity.begin());
  return entity;
}

/// Why a writer and a reader of a topic do not match: the setting, and what each side has.
[[nodiscard]] std::string mismatch_of(const std::string& topic, edds::QosPolicyId_t policy);
/// Once for each.
void log_mismatch(const std::string& mismatch);

/// A writer with a publisher of its own, hence in a DDS partition of its own.
class Writer final : public edds::DataWriterListener {
 public:
  /// @param partition  DDS partition; empty: the default one
  /// @param on_reader  called when one more reader was matched: data written from now on reaches
  ///   it. Called by a thread of the library, which may hold locks
  Writer(const Context& context, edds::Topic& topic, const std::string& partition,
         const std::string& profile, std::function<void()> on_reader = nullptr);
  ~Writer() override;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  [[nodiscard]] bool good() const { return writer_ != nullptr; }
  /// @return kTransport, with what could not be created; then nothing can be written
  [[nodiscard]] const Result<void>& check() const { return check_; }

  /// Whether a reader has been discovered. Does not wait.
  [[nodiscard]] bool matched() const { return readers_ > 0; }

  /// Waits until a reader has been discovered; false at the deadline.
  [[nodiscard]] bool wait_until_matched(Deadline deadline);

  /// A sample of the topic's type. Thread-safe.
  bool write(void* sample);

  /// The participants whose readers are matched.
  [[nodiscard]] std::vector<PeerId> readers() const;
  /// Waits for another match, or the end of one.
  void wait_for_readers(Deadline deadline);

  /// Since when a reader has been discovered, without a pause; only while matched().
  [[nodiscard]] Deadline matched_at() const { return matched_at_.load(std::memory_order_relaxed); }

  /// Records that what the readers send back reaches this participant, until they have left.
  void hear_replies() { replies_arrive_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool replies_arrive() const {
    return replies_arrive_.load(std::memory_order_relaxed);
  }

  /// For a reliable writer: waits until all readers have acknowledged everything written. False at
  /// the deadline.
  [[nodiscard]] bool flush(Deadline deadline) { return flush(mark(), deadline, {}, nullptr); }

  /// What was written so far.
  struct Mark {
    std::uint64_t written = 0;  // number of samples
    std::uint64_t last = 0;     // the number that DDS gave to the last of them
  };
  [[nodiscard]] Mark mark() const { return {written_, last_}; }

  /// The same for what was written until then, without waiting for some readers.
  /// @param gone  whether a participant will never acknowledge anything
  /// @param acknowledgements  is asked if there are such readers
  [[nodiscard]] bool flush(const Mark& mark, Deadline deadline,
                           const std::function<bool(const PeerId&)>& gone,
                           Acknowledgements* acknowledgements);

  /// Records that this participant depends on the readers now.
  void use(Deadline now) { last_use_.store(now, std::memory_order_relaxed); }
  [[nodiscard]] Deadline last_use() const { return last_use_.load(std::memory_order_relaxed); }

  /// Why a reader that was discovered does not match (mismatch_of()); empty: none was.
  [[nodiscard]] std::string mismatch() const;

  void on_publication_matched(edds::DataWriter*,
                              const edds::PublicationMatchedStatus& status) override;
  void on_offered_incompatible_qos(edds::DataWriter* writer,
                                   const edds::OfferedIncompatibleQosStatus& status) override;

 private:
  [[nodiscard]] bool await_all(Deadline deadline);
  [[nodiscard]] bool await_some(const Mark& mark, Deadline deadline,
                                const std::vector<PeerId>& readers,
                                Acknowledgements& acknowledgements) const;

  const Context context_;
  const std::function<void()> on_reader_;
  edds::Publisher* publisher_ = nullptr;
  edds::DataWriter* writer_ = nullptr;
  Result<void> check_;
  EndpointNumbers::Id number_ = EndpointNumbers::kNone;
  mutable Mutex mutex_;
  std::string mismatch_ TFDUDE_GUARDED_BY(mutex_);
  Condition matched_;
  // The readers, and what was written before each was matched, which it is not sent.
  std::multimap<PeerId, std::uint64_t> readers_before_ TFDUDE_GUARDED_BY(mutex_);
  std::atomic<int> readers_{0};                 // changed under mutex_
  std::atomic<std::uint64_t> written_{0};       // number of samples, counted once written
  std::atomic<std::uint64_t> last_{0};          // as in Mark
  std::atomic<std::uint64_t> acknowledged_{0};  // at least so many of them
  std::atomic<Deadline> last_use_{Deadline::min()};
  std::atomic<Deadline> matched_at_{Deadline::min()};
  std::atomic<bool> replies_arrive_{false};
  std::recursive_mutex writing_;  // as Fast DDS's own
  GrowingStamp source_stamp_;     // under writing_
};

/// The writer of a DDS sample.
[[nodiscard]] inline const ertps::GUID_t& writer_of(const edds::SampleInfo& info) {
  return info.sample_identity.writer_guid();
}

/// A reader with its own subscriber, hence in its own DDS partition. It passes DDS samples on one
/// at a time, those of one writer in the order in which they were written.
template <class Sample>
class Reader : public edds::DataReaderListener {
 public:
  /// What to call. +1: a writer was matched; -1: no more.
  struct Calls {
    std::function<void(const Sample&, const edds::SampleInfo&)> on_sample;
    std::function<void(const ertps::GUID_t& writer, int change)> on_matched;
  };

  Reader(const Context& context, edds::TopicDescription& topic, const std::string& partition,
         const std::string& profile, Calls calls)
      : context_(context), calls_(std::move(calls)) {
    edds::SubscriberQos qos = context.participant.get_default_subscriber_qos();
    if (!partition.empty()) qos.partition().push_back(partition.c_str());
    const std::string name = endpoint_name("reader", topic.get_name(), partition);
    check_ = created("the subscriber of " + name,
                     [&] { return context.participant.create_subscriber(qos); })
                 .and_then([&](edds::Subscriber* subscriber) {
                   subscriber_ = subscriber;
                   return created(name, [&] {
                     const Lock lock(endpoints_change());
                     return subscriber->create_datareader(
                         &topic, context.profiles.reader(*subscriber, profile), this);
                   });
                 })
                 .map([&](edds::DataReader* reader) { reader_ = reader; });
    if (!check_) return;
    number_ = context.announced.readers.created([this] { announce_again(*reader_); });
    context.announced.all->created(entity_of(reader_->guid()));
  }

  ~Reader() override { close(); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// @return kTransport, with what could not be created
  [[nodiscard]] const Result<void>& check() const { return check_; }

  void close() {
    context_.announced.readers.deleted(std::exchange(number_, EndpointNumbers::kNone));
    if (reader_ != nullptr) context_.announced.all->deleted(entity_of(reader_->guid()));
    const Gate::Pause pause(context_.gate);
    const Lock lock(endpoints_change());
    if (reader_ != nullptr) subscriber_->delete_datareader(reader_);
    if (subscriber_ != nullptr) context_.participant.delete_subscriber(subscriber_);
    reader_ = nullptr;
    subscriber_ = nullptr;
  }

  void on_data_available(edds::DataReader* reader) override {
    const Lock lock(mutex_);
    std::size_t taken = 0;
    while (true) {
      if (taken == batch_.size()) batch_.emplace_back();
      Taken& next = batch_[taken];
      if (!ok(reader->take_next_sample(&next.sample, &next.info))) break;
      if (next.info.valid_data) ++taken;
    }
    // The library hands out one instance after the other, not in the order in which they were sent.
    const auto end = batch_.begin() + static_cast<std::ptrdiff_t>(taken);
    std::sort(batch_.begin(), end, [](const Taken& a, const Taken& b) {
      return a.info.sample_identity.sequence_number() < b.info.sample_identity.sequence_number();
    });
    for (auto one = batch_.begin(); one != end; ++one) calls_.on_sample(one->sample, one->info);
  }

  void on_requested_incompatible_qos(edds::DataReader* reader,
                                     const edds::RequestedIncompatibleQosStatus& status) override {
    log_mismatch(mismatch_of(reader->get_topicdescription()->get_name(), status.last_policy_id));
  }

  void on_subscription_matched(edds::DataReader*,
                               const edds::SubscriptionMatchedStatus& status) override {
    if (!calls_.on_matched || status.current_count_change == 0) return;
    calls_.on_matched(ertps::iHandle2GUID(status.last_publication_handle),
                      status.current_count_change);
  }

 private:
  struct Taken {
    Sample sample;
    edds::SampleInfo info;
  };

  const Context context_;
  const Calls calls_;
  Mutex mutex_{LockRank::kReceiving};                  // the library may call from several threads
  std::deque<Taken> batch_ TFDUDE_GUARDED_BY(mutex_);  // kept, for their memory
  edds::Subscriber* subscriber_ = nullptr;
  edds::DataReader* reader_ = nullptr;
  Result<void> check_;
  EndpointNumbers::Id number_ = EndpointNumbers::kNone;
};

}  // namespace tfdude::fastdds
