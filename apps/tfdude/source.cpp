#include "source.hpp"

namespace tfdude::cli {
namespace {

// How much of a recording is read on for data, by default.
constexpr Milliseconds kWait{10'000};

}  // namespace

Result<Time> Source::now() const { return client_ != nullptr ? client_->now() : end_; }

Result<Time> Source::present() const {
  return client_ != nullptr ? client_->now() : recording_->instant();
}

std::optional<Time> Source::end_for(Time stamp) const {
  // A sample may be older than the recording.
  constexpr std::chrono::hours kDay{24};
  const auto start = recording_->summary().start;
  if (!start || stamp < *start - kDay || stamp > end_ + kDay) return std::nullopt;
  return end_;
}

Result<std::vector<Frame>> Source::frames() const {
  if (client_ != nullptr) return client_->frames();
  return recording_->frames();
}

Result<std::vector<PartitionInfo>> Source::partitions() const {
  if (client_ != nullptr) return client_->partitions();
  return recording_->partitions();
}

Result<std::vector<PathSegment>> Source::path(const std::string& a, const std::string& b) const {
  return client_ != nullptr ? client_->path(a, b) : recording_->path(a, b);
}

Result<std::vector<JointInfo>> Source::joints(const std::string& partition) const {
  return client_ != nullptr ? client_->joints(partition) : recording_->joints(partition);
}

Result<std::vector<HistoryInfo>> Source::histories(const std::string& partition) const {
  return client_ != nullptr ? client_->histories(partition) : recording_->histories(partition);
}

Result<StampedTransform> Source::lookup(const std::string& a, const std::string& b,
                                        const Query& query) const {
  if (client_ != nullptr) return client_->lookup(a, b, query);
  return lookup(a, b, query, kWait);
}

Result<StampedTransform> Source::lookup(const std::string& a, const std::string& b,
                                        const Query& query, Milliseconds wait) const {
  if (client_ != nullptr) return client_->lookup(a, b, query, wait);
  const auto start = recording_->summary().start;
  if (query.at && start && *query.at < *start) recording_->seek(end_);
  if (!query.at || *query.at < recording_->instant()) return recording_->lookup(a, b, query);
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
