#pragma once

#include <optional>
#include <string>

#include "tfdude/transport/fastdds.hpp"

#include "transport/fastdds/compat.hpp"
#include "transport/fastdds/fair_share.hpp"
#include "transport/port.hpp"

// The library's interfaces have no virtual destructor; the classes here are final and never deleted
// through them. NOLINTBEGIN(cppcoreguidelines-virtual-class-destructor)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"

namespace tfdude::fastdds {

/// The filters of a partition's readers. They pass messages about a frame or joint that the
/// partition owns, and requests addressed to it by name. They drop the messages of senders that
/// flood it. They are evaluated at the reader, on the bytes, against the current set of owned
/// frames: the announced expression, the partition's name, never changes. They read no more than
/// they need: what passes is checked as a whole before it is deserialized (CheckedType).
class OwnedFilters final : public edds::IContentFilterFactory {
 public:
  /// The name under which the class is registered and announced.
  static constexpr const char* kClassName = "tfdude.owned";

  /// The handler, the counters and the shares outlive this.
  OwnedFilters(const std::string& partition, const TransportHandler& handler,
               FastDdsCounters& counters, FairShare& fair_share);

  ReturnCode create_content_filter(const char* filter_class_name, const char* type_name,
                                   const edds::TopicDataType* data_type, const char* expression,
                                   const ParameterSeq& parameters,
                                   edds::IContentFilter*& filter) override;
  ReturnCode delete_content_filter(const char* filter_class_name,
                                   edds::IContentFilter* filter) override;

 private:
  /// What all filters look at.
  struct View {
    std::uint32_t addressee;
    const TransportHandler& handler;
    FastDdsCounters& counters;
    FairShare& fair_share;

    /// Whether the sender has not taken too much time already.
    [[nodiscard]] bool admits(const edds::IContentFilter::FilterSampleInfo& info) const;
    /// Counts a stream's sample, and says whether it passes.
    /// @param concerned  whether the partition owns some of it; nothing: it is malformed
    [[nodiscard]] bool pass(std::optional<bool> concerned, const char* topic) const;
  };

  class Requests final : public edds::IContentFilter {
   public:
    explicit Requests(const View& view) : view_(view) {}
    [[nodiscard]] bool evaluate(const SerializedPayload& payload, const FilterSampleInfo& info,
                                const GUID_t& reader) const override;

   private:
    const View& view_;
  };

  class Updates final : public edds::IContentFilter {
   public:
    explicit Updates(const View& view) : view_(view) {}
    [[nodiscard]] bool evaluate(const SerializedPayload& payload, const FilterSampleInfo& info,
                                const GUID_t& reader) const override;

   private:
    const View& view_;
  };

  class Joints final : public edds::IContentFilter {
   public:
    explicit Joints(const View& view) : view_(view) {}
    [[nodiscard]] bool evaluate(const SerializedPayload& payload, const FilterSampleInfo& info,
                                const GUID_t& reader) const override;

   private:
    const View& view_;
  };

  const View view_;
  Requests requests_{view_};
  Updates updates_{view_};
  Joints joints_{view_};
};

}  // namespace tfdude::fastdds

// NOLINTEND(cppcoreguidelines-virtual-class-destructor)
#pragma GCC diagnostic pop
