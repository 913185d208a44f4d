#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

// DDS writers that do not use this project's library: they send what any program in the domain may
// send.
namespace tfdude::testing {

using Bytes = std::vector<std::uint8_t>;

/// A type with any name that sends any bytes: the sample is a Bytes, which includes the
/// encapsulation header.
class RawType final : public fastdds::edds::TopicDataType {
 public:
  RawType(const std::string& name, bool keyed);

#if TFDUDE_FASTDDS_MAJOR == 2
  bool serialize(void* data, fastdds::ertps::SerializedPayload_t* payload) override {
    return fill(*static_cast<const Bytes*>(data), *payload);
  }
  bool deserialize(fastdds::ertps::SerializedPayload_t*, void*) override { return false; }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, fastdds::ertps::InstanceHandle_t* handle, bool) override {
    handle->value[0] = 1;
    return true;
  }
#else
  bool serialize(const void* const data, fastdds::ertps::SerializedPayload_t& payload,
                 fastdds::edds::DataRepresentationId_t) override {
    return fill(*static_cast<const Bytes*>(data), payload);
  }
  bool deserialize(fastdds::ertps::SerializedPayload_t&, void*) override { return false; }
  std::uint32_t calculate_serialized_size(const void* const data,
                                          fastdds::edds::DataRepresentationId_t) override {
    return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size());
  }
  void* create_data() override { return new Bytes; }
  void delete_data(void* data) override { delete static_cast<Bytes*>(data); }
  bool compute_key(fastdds::ertps::SerializedPayload_t&, fastdds::ertps::InstanceHandle_t& handle,
                   bool) override {
    handle.value[0] = 1;
    return true;
  }
  bool compute_key(const void* const, fastdds::ertps::InstanceHandle_t& handle, bool) override {
    handle.value[0] = 1;
    return true;
  }
#endif

 private:
  static bool fill(const Bytes& bytes, fastdds::ertps::SerializedPayload_t& payload);
};

/// The bytes of a sample of a generated type on the wire.
template <class GeneratedType, class Sample>
Bytes bytes_of(Sample sample) {
  GeneratedType type;
  fastdds::ertps::SerializedPayload_t payload(1U << 16U);
#if TFDUDE_FASTDDS_MAJOR == 2
  const bool done = type.serialize(&sample, &payload);
#else
  const bool done = type.serialize(&sample, payload,
                                   fastdds::edds::DataRepresentationId_t::XCDR_DATA_REPRESENTATION);
#endif
  return done ? Bytes(payload.data, payload.data + payload.length) : Bytes();
}

/// What a participant says of itself in discovery.
struct Name {
  std::string name;
  std::string user_data;
};

/// The last reply that came.
class Replies : public fastdds::edds::DataReaderListener {
 public:
  void on_data_available(fastdds::edds::DataReader* reader) override;
  [[nodiscard]] std::optional<Reply> last() const;

 private:
  mutable std::mutex mutex_;
  std::optional<Reply> last_;
};

/// A participant with one writer on one topic, on this computer only.
class ForeignWriter {
 public:
  /// @param partition  of DDS; empty: the default one
  /// @throws std::runtime_error if it cannot be created.
  ForeignWriter(std::uint32_t domain, const char* topic, fastdds::edds::TypeSupport type,
                const std::string& partition, bool durable = false, const Name& name = {});
  ~ForeignWriter();

  /// Reads the replies to this participant.
  [[nodiscard]] std::shared_ptr<const Replies> read_replies();
  ForeignWriter(const ForeignWriter&) = delete;
  ForeignWriter& operator=(const ForeignWriter&) = delete;

  /// Waits until so many readers are matched. @throws std::runtime_error if they are not.
  void await_readers(int count);

  /// Mutes the writer, or ends that: while it is muted, nothing that it sends arrives.
  void mute(bool muted) { *muted_ = muted; }

  /// A sample of the writer's type. @param ahead  by how much the writer's clock is
  /// @throws std::runtime_error if DDS does not accept it.
  void write(void* sample, std::chrono::nanoseconds ahead = {});

 private:
  const std::shared_ptr<Replies> replies_ = std::make_shared<Replies>();
  const std::shared_ptr<std::atomic<bool>> muted_ = std::make_shared<std::atomic<bool>>(false);
  fastdds::edds::DomainParticipant* participant_ = nullptr;
  fastdds::edds::DataWriter* writer_ = nullptr;
};

}  // namespace tfdude::testing
