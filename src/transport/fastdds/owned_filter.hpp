#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "tfdude/transport/fastdds.hpp"

#include "transport/fastdds/compat.hpp"
#include "transport/port.hpp"

// The library's interfaces have no virtual destructor; the classes here are final and never deleted
// through them. NOLINTBEGIN(cppcoreguidelines-virtual-class-destructor)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wnon-virtual-dtor"

namespace tfdude::fastdds {

/// The filters of a partition's readers. They pass messages about a frame or joint that the
/// partition owns, and requests addressed to it by name. They are evaluated at the reader, on the
/// bytes, against the current set of owned frames: the announced expression, the partition's name,
/// never changes. They read no more than they need: what passes is checked as a whole before it is
/// deserialized (CheckedType).
class OwnedFilters final : public edds::IContentFilterFactory {
 public:
  /// The name under which the class is registered and announced.
  static constexpr const char* kClassName = "tfdude.owned";

  /// The handler and the counters outlive this.
  OwnedFilters(const std::string& partition, const TransportHandler& handler,
               FastDdsCounters& counters);

  ReturnCode create_content_filter(const char* filter_class_name, const char* type_name,
                                   const edds::TopicDataType* data_type, const char* expression,
                                   const ParameterSeq& parameters,
                                   edds::IContentFilter*& filter) override;
  ReturnCode delete_content_filter(const char* filter_class_name,
                                   edds::IContentFilter* filter) override;

 private:
  class Filter final : public edds::IContentFilter {
   public:
    /// Whether a message concerns the partition; nothing: it is malformed.
    using Concerns = std::function<std::optional<bool>(const std::uint8_t* data, std::size_t size)>;

    Filter(OwnedFilters& all, const char* topic, std::atomic<std::uint64_t>& arrived,
           std::atomic<std::uint64_t>& passed, Concerns concerns)
        : all_(all),
          topic_(topic),
          arrived_(arrived),
          passed_(passed),
          concerns_(std::move(concerns)) {}

    [[nodiscard]] bool evaluate(const SerializedPayload& payload, const FilterSampleInfo& info,
                                const GUID_t& reader) const override;

   private:
    OwnedFilters& all_;
    const char* const topic_;
    std::atomic<std::uint64_t>& arrived_;
    std::atomic<std::uint64_t>& passed_;
    const Concerns concerns_;
  };

  FastDdsCounters& counters_;
  Filter requests_;
  Filter updates_;
  Filter joints_;
};

}  // namespace tfdude::fastdds

// NOLINTEND(cppcoreguidelines-virtual-class-destructor)
#pragma GCC diagnostic pop
