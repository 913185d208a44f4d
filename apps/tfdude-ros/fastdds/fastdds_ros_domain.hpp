#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "../ros_domain.hpp"
#include "transport/fastdds/compat.hpp"

namespace tfdude::ros {

/// What is known of the other bridges in the ROS domain, by the GUID prefixes of their
/// participants. Thread-safe. A ParticipantListener reports to it.
class Bridges {
 public:
  using Prefix = fastdds::ertps::GuidPrefix_t;

  void met(const Prefix& prefix, const std::string& name, const std::vector<std::uint8_t>& data);
  void changed(const Prefix&, const std::string&, const std::vector<std::uint8_t>&) {}
  void left(const Prefix& prefix);
  void authenticated(const Prefix&, bool) {}
  void writer_found(const fastdds::ertps::GUID_t&, const std::string&,
                    const std::vector<std::string>&) {}
  void writer_lost(const fastdds::ertps::GUID_t&) {}
  void endpoint_found(const fastdds::ertps::GUID_t&, std::uint64_t) {}
  void endpoint_lost(const fastdds::ertps::GUID_t&) {}

  /// None if the participant is no bridge.
  [[nodiscard]] std::optional<BridgeMark> find(const Prefix& prefix) const;
  [[nodiscard]] std::vector<BridgeMark> present() const;

 private:
  mutable std::mutex mutex_;
  std::map<Prefix, BridgeMark> present_;
};

class FastDdsRosDomain final : public RosDomain {
 public:
  [[nodiscard]] static Result<std::unique_ptr<FastDdsRosDomain>> join(const RosSettings& settings);
  FastDdsRosDomain(const FastDdsRosDomain&) = delete;
  FastDdsRosDomain& operator=(const FastDdsRosDomain&) = delete;
  ~FastDdsRosDomain() override;

  [[nodiscard]] Result<void> subscribe(const Topic& topic, Take take) override;
  [[nodiscard]] Result<std::unique_ptr<Publisher>> advertise(const Topic& topic) override;
  [[nodiscard]] std::vector<BridgeMark> bridges() const override { return bridges_.present(); }
  [[nodiscard]] std::uint64_t malformed() const override;

 private:
  FastDdsRosDomain() : listener_(bridges_) {}

  [[nodiscard]] Result<void> create(const RosSettings& settings);
  /// @return null if DDS cannot create it
  [[nodiscard]] fastdds::edds::Topic* topic_of(const Topic& topic);

  Bridges bridges_;
  fastdds::ParticipantListener<Bridges> listener_;
  fastdds::edds::DomainParticipant* participant_ = nullptr;
  fastdds::edds::Publisher* publisher_ = nullptr;
  fastdds::edds::Subscriber* subscriber_ = nullptr;
  std::mutex mutex_;  // of what follows
  std::vector<std::unique_ptr<fastdds::edds::DataReaderListener>> readers_;
};

}  // namespace tfdude::ros
