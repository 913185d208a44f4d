#include "source.hpp"

namespace tfdude::cli {

std::optional<Time> Source::end_for(Time stamp) const {
  // A sample may be older than the recording.
  constexpr std::chrono::hours kDay{24};
  const auto start = recording_->summary().start;
  if (!start || stamp < *start - kDay || stamp > end_ + kDay) return std::nullopt;
  return end_;
}

Result<StampedTransform> Source::lookup(const std::string& a, const std::string& b,
                                        const Query& query, Milliseconds wait) const {
  if (client_ != nullptr) return client_->lookup(a, b, query, wait);
  if (!query.at || *query.at < from_ || query.believed_at) return recording_->lookup(a, b, query);
  return recording_->lookup_at(a, b, *query.at, query, wait);
}

Result<StampedTransform> Source::lookup(const std::string& a, const Query& at_a,
                                        const std::string& b, const Query& at_b,
                                        const std::string& fixed) const {
  if (client_ != nullptr) return client_->lookup(a, at_a, b, at_b, fixed);
  const Time instant = recording_->instant();
  return recording_->lookup_at(a, at_a.at.value_or(instant), b, at_b.at.value_or(instant), fixed,
                               at_a);
}

}  // namespace tfdude::cli
