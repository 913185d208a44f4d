#include "transport/fastdds/owned_filter.hpp"

#include <string_view>

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/fair_share.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {

OwnedFilters::OwnedFilters(const std::string& partition, const TransportHandler& handler,
                           FastDdsCounters& counters)
    : counters_(counters),
      requests_(*this, kRequestTopic, counters.requests_arrived, counters.requests_passed,
                [&handler, own = addressee_of(partition)](const std::uint8_t* data,
                                                          std::size_t size) -> std::optional<bool> {
                  const auto head = read_request_head(data, size);
                  if (!head) return std::nullopt;
                  return head->addressee == own || handler.owns(head->id);
                }),
      updates_(*this, kUpdateTopic, counters.updates_arrived, counters.updates_passed,
               [&handler](const std::uint8_t* data, std::size_t size) {
                 return any_edge(data, size, [&](std::string_view id) { return handler.owns(id); });
               }),
      joints_(*this, kJointTopic, counters.updates_arrived, counters.updates_passed,
              [&handler](const std::uint8_t* data, std::size_t size) {
                return any_joint(data, size,
                                 [&](std::string_view name) { return handler.owns_joint(name); });
              }) {}

bool OwnedFilters::Filter::evaluate(const SerializedPayload& payload, const FilterSampleInfo&,
                                    const GUID_t&) const {
  FairShare::has_message();
  arrived_.fetch_add(1, std::memory_order_relaxed);
  const auto concerned = concerns_(payload.data, payload.length);
  if (!concerned) count_malformed(all_.counters_, topic_);
  const bool passes = concerned.value_or(false);
  if (passes) passed_.fetch_add(1, std::memory_order_relaxed);
  return passes;
}

ReturnCode OwnedFilters::create_content_filter(const char* filter_class_name, const char* type_name,
                                               const edds::TopicDataType*, const char*,
                                               const ParameterSeq&, edds::IContentFilter*& filter) {
  if (std::string_view(filter_class_name) != kClassName) return bad_parameter();
  if (type_name == name_of(RequestType())) {
    filter = &requests_;
  } else if (type_name == name_of(JointsType())) {
    filter = &joints_;
  } else {
    filter = &updates_;
  }
  return done();
}

ReturnCode OwnedFilters::delete_content_filter(const char*, edds::IContentFilter*) {
  return done();
}

}  // namespace tfdude::fastdds
