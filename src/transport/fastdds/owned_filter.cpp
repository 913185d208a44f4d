#include "transport/fastdds/owned_filter.hpp"

#include <string_view>

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/peers.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {

OwnedFilters::OwnedFilters(const std::string& partition, const TransportHandler& handler,
                           FastDdsCounters& counters, FairShare& fair_share)
    : view_{addressee_of(partition), handler, counters, fair_share} {}

bool OwnedFilters::View::admits(const edds::IContentFilter::FilterSampleInfo& info) const {
  return fair_share.admits(peer_of(info.sample_identity.writer_guid().guidPrefix),
                           FairShare::Clock::now());
}

bool OwnedFilters::Requests::evaluate(const SerializedPayload& payload,
                                      const FilterSampleInfo& info, const GUID_t&) const {
  if (!view_.admits(info)) return false;
  view_.counters.requests_arrived.fetch_add(1, std::memory_order_relaxed);
  const auto head = read_request_head(payload.data, payload.length);
  if (!head) {
    count_malformed(view_.counters, kRequestTopic);
    return false;
  }
  const bool passes = head->addressee == view_.addressee || view_.handler.owns(head->id);
  if (passes) view_.counters.requests_passed.fetch_add(1, std::memory_order_relaxed);
  return passes;
}

bool OwnedFilters::View::pass(std::optional<bool> concerned, const char* topic) const {
  counters.updates_arrived.fetch_add(1, std::memory_order_relaxed);
  if (!concerned) count_malformed(counters, topic);
  const bool passes = concerned.value_or(false);
  if (passes) counters.updates_passed.fetch_add(1, std::memory_order_relaxed);
  return passes;
}

bool OwnedFilters::Joints::evaluate(const SerializedPayload& payload, const FilterSampleInfo& info,
                                    const GUID_t&) const {
  if (!view_.admits(info)) return false;
  const auto owns = [this](std::string_view name) { return view_.handler.owns_joint(name); };
  return view_.pass(any_joint(payload.data, payload.length, owns), kJointTopic);
}

bool OwnedFilters::Updates::evaluate(const SerializedPayload& payload, const FilterSampleInfo& info,
                                     const GUID_t&) const {
  if (!view_.admits(info)) return false;
  const auto owns = [this](std::string_view id) { return view_.handler.owns(id); };
  return view_.pass(any_edge(payload.data, payload.length, owns), kUpdateTopic);
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
