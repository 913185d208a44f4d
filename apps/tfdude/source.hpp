#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/recording/recording.hpp"

namespace tfdude::cli {

/// The live system, or a recording at the instant that it shows: what answers a command. A
/// reference to either of them.
class Source {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): a client is one
  Source(Client& client) : client_(&client) {}
  /// The end of the recording is now, for stamps that count back from it.
  explicit Source(Recording& recording)
      : recording_(&recording), end_(recording.instant()), from_(end_) {}

  /// From now on answers a recording as of a stamp.
  void go_to(Time stamp) {
    from_ = recording_->instant_for(stamp);
    recording_->seek(from_);
  }

  [[nodiscard]] bool live() const { return client_ != nullptr; }
  /// The end of a recording.
  [[nodiscard]] Result<Time> now() const { return live() ? client_->now() : end_; }
  /// The time to compare stamps with: of a recording, the instant that it shows.
  [[nodiscard]] Result<Time> present() const {
    return live() ? client_->now() : recording_->instant();
  }
  /// The end of a recording, to say how long before it a stamp is; absent if that is of another
  /// clock.
  [[nodiscard]] std::optional<Time> end_for(Time stamp) const;

  /// Of live partitions only.
  [[nodiscard]] Result<ClockDifference> clock_difference(const std::string& partition) const {
    return live() ? client_->clock_difference(partition)
                  : fail(Errc::kUnsupported, "a recording has no clock of its own");
  }

  // As the functions of Client.
  [[nodiscard]] Result<std::vector<Frame>> frames() const {
    return live() ? client_->frames() : recording_->frames();
  }
  [[nodiscard]] Result<std::vector<PartitionInfo>> partitions() const {
    return live() ? client_->partitions() : recording_->partitions();
  }
  [[nodiscard]] Result<std::vector<PathSegment>> path(const std::string& a,
                                                      const std::string& b) const {
    return live() ? client_->path(a, b) : recording_->path(a, b);
  }
  [[nodiscard]] Result<std::vector<JointInfo>> joints(const std::string& partition) const {
    return live() ? client_->joints(partition) : recording_->joints(partition);
  }
  [[nodiscard]] Result<std::vector<HistoryInfo>> histories(const std::string& partition) const {
    return live() ? client_->histories(partition) : recording_->histories(partition);
  }
  /// A recording is read on until it has the data, as Recording::lookup_at() does, but not for an
  /// instant before the one that was gone to, or with Query::believed_at: of that it has what was
  /// known there.
  /// @param wait  how much of a recording is read on
  [[nodiscard]] Result<StampedTransform> lookup(const std::string& a, const std::string& b,
                                                const Query& query, Milliseconds wait) const;
  [[nodiscard]] Result<StampedTransform> lookup(const std::string& a, const std::string& b,
                                                const Query& query = {}) const {
    constexpr Milliseconds kWait{10'000};
    return live() ? client_->lookup(a, b, query) : lookup(a, b, query, kWait);
  }
  [[nodiscard]] Result<StampedTransform> lookup(const std::string& a, const Query& at_a,
                                                const std::string& b, const Query& at_b,
                                                const std::string& fixed) const;

 private:
  Client* client_ = nullptr;
  Recording* recording_ = nullptr;
  Time end_{};
  Time from_{};  // the instant that was gone to
};

}  // namespace tfdude::cli
