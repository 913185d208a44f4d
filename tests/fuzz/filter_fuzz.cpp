// Passes any bytes to the filters of a partition's readers: fields that they read without
// deserializing must be equal to the deserialized ones.

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include <fastdds/dds/core/LoanableSequence.hpp>
#include <spdlog/spdlog.h>

#include "base/log.hpp"
#include "fuzz/demand.hpp"
#include "support/deaf_handler.hpp"
#include "support/samples.hpp"
#include "transport/fastdds/owned_filter.hpp"

namespace tfdude::fuzz {
namespace {

using testing::Bytes;

// Not the partition to which the seeds are addressed, so that the frame's owner matters.
constexpr const char* kPartition = "legs";

class Owner final : public testing::DeafHandler {
 public:
  [[nodiscard]] bool owns(std::string_view id) const override { return id == "hand" || id == "x"; }
  [[nodiscard]] bool owns_joint(std::string_view name) const override { return name == "hand"; }
};

class Filters {
 public:
  Filters() {
    log().set_level(spdlog::level::off);
    requests_ = created(fastdds::RequestType());
    updates_ = created(fastdds::UpdateType());
    joints_ = created(fastdds::JointsType());
  }

  void run(Bytes& bytes) {
    demand_passes(*requests_, bytes, request_concerns(bytes));
    demand_passes(*updates_, bytes, update_concerns(bytes));
    demand_passes(*joints_, bytes, joints_concern(bytes));
  }

 private:
  fastdds::edds::IContentFilter* created(const fastdds::edds::TopicDataType& type) {
    fastdds::edds::IContentFilter* filter = nullptr;
    const auto code = filters_.create_content_filter(
        fastdds::OwnedFilters::kClassName, fastdds::name_of(type).c_str(), &type, "",
        fastdds::edds::LoanableSequence<const char*>(), filter);
    demand(fastdds::ok(code) && filter != nullptr, "there is a filter");
    return filter;
  }

  static bool passes(const fastdds::edds::IContentFilter& filter, Bytes& bytes) {
    const testing::BorrowedPayload payload(bytes.data(), bytes.size());
    return filter.evaluate(payload, {}, {});
  }

  // What is malformed may pass: it is rejected when it is deserialized.
  static void demand_passes(const fastdds::edds::IContentFilter& filter, Bytes& bytes,
                            std::optional<bool> concerns) {
    const bool passed = passes(filter, bytes);
    demand(!concerns || passed == *concerns, "what concerns the owner passes, and nothing else");
  }

  [[nodiscard]] std::optional<bool> request_concerns(const Bytes& bytes) const {
    wire::Request sample;
    if (!testing::deserialized<fastdds::RequestType>(bytes, sample)) return std::nullopt;
    return sample.addressee() == fastdds::addressee_of(kPartition) ||
           owner_.owns(sample.id().c_str());
  }

  [[nodiscard]] std::optional<bool> update_concerns(const Bytes& bytes) const {
    wire::Update sample;
    if (!testing::deserialized<fastdds::UpdateType>(bytes, sample)) return std::nullopt;
    return std::any_of(sample.edges().begin(), sample.edges().end(),
                       [this](const wire::Edge& edge) { return owner_.owns(edge.id().c_str()); });
  }

  [[nodiscard]] std::optional<bool> joints_concern(const Bytes& bytes) const {
    wire::Joints sample;
    if (!testing::deserialized<fastdds::JointsType>(bytes, sample)) return std::nullopt;
    return std::any_of(
        sample.positions().begin(), sample.positions().end(),
        [this](const wire::JointPosition& joint) { return owner_.owns_joint(joint.id().c_str()); });
  }

  Owner owner_;
  FastDdsCounters counters_;
  fastdds::OwnedFilters filters_{kPartition, owner_, counters_};
  fastdds::edds::IContentFilter* requests_ = nullptr;
  fastdds::edds::IContentFilter* updates_ = nullptr;
  fastdds::edds::IContentFilter* joints_ = nullptr;
};

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static tfdude::fuzz::Filters filters;
  tfdude::testing::Bytes bytes(data, data + size);
  filters.run(bytes);
  return 0;
}
