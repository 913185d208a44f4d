#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/client/client.hpp"
#include "tfdude/recording/recording.hpp"

// One interface over what answers lookups, so that an algorithm is written once: for the live
// system, a recording, watched edges, and a table of transforms in tests.
namespace tfdude {

/// What answers lookups.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// @param wait  for missing frames and data; of a recording, how much of it is read on
  /// @return as Client::lookup()
  [[nodiscard]] virtual Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                        const Query& query = {},
                                                        Milliseconds wait = {}) = 0;

  /// As Client::lookup() with two instants. @return kUnsupported: this source cannot
  [[nodiscard]] virtual Result<StampedTransform> lookup_over(
      std::string_view /*a*/, const Query& /*at_a*/, std::string_view /*b*/, const Query& /*at_b*/,
      std::string_view /*fixed*/, Milliseconds /*wait*/) {
    return fail(Errc::kUnsupported, "this source only answers lookups at one time");
  }
  /// The frames that are known. @return kUnsupported: this source cannot
  [[nodiscard]] virtual Result<std::vector<Frame>> frames() {
    return fail(Errc::kUnsupported, "this source does not tell its frames");
  }
};

/// A live system. The client must outlive this.
class ClientSource final : public FrameSource {
 public:
  explicit ClientSource(Client& client) : client_(client) {}
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query, Milliseconds wait) override {
    if (wait > Milliseconds(0)) return client_.lookup(a, b, query, wait);
    return client_.lookup(a, b, query);
  }
  [[nodiscard]] Result<StampedTransform> lookup_over(std::string_view a, const Query& at_a,
                                                     std::string_view b, const Query& at_b,
                                                     std::string_view fixed,
                                                     Milliseconds wait) override {
    return client_.lookup(a, at_a, b, at_b, fixed, wait);
  }
  [[nodiscard]] Result<std::vector<Frame>> frames() override { return client_.frames(); }

 private:
  Client& client_;
};

/// A recording, at the instant that it shows; with an instant in the query, at that one. Nobody has
/// to wait for a recording: without a wait, it is read on as far as Recording::lookup_at() does by
/// itself. The recording must outlive this.
/// @par Thread safety  One thread at a time.
class RecordingSource final : public FrameSource {
 public:
  explicit RecordingSource(Recording& recording) : recording_(recording) {}
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query, Milliseconds wait) override {
    if (!query.at) return recording_.lookup(a, b, query);
    if (wait <= Milliseconds(0)) return recording_.lookup_at(a, b, *query.at, query);
    return recording_.lookup_at(a, b, *query.at, query, wait);
  }
  /// Without an instant, at the one that is shown. Reads on as without a wait.
  [[nodiscard]] Result<StampedTransform> lookup_over(std::string_view a, const Query& at_a,
                                                     std::string_view b, const Query& at_b,
                                                     std::string_view fixed,
                                                     Milliseconds /*wait*/) override {
    const Time shown = recording_.instant();
    return recording_.lookup_at(a, at_a.at.value_or(shown), b, at_b.at.value_or(shown), fixed,
                                at_a);
  }
  [[nodiscard]] Result<std::vector<Frame>> frames() override { return recording_.frames(); }

 private:
  Recording& recording_;
};

/// Watched edges: answers from memory, and does not wait.
class WatchSource final : public FrameSource {
 public:
  explicit WatchSource(EdgesWatch edges) : edges_(std::move(edges)) {}
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query,
                                                Milliseconds /*wait*/) override {
    return edges_.lookup(a, b, query);
  }

 private:
  EdgesWatch edges_;
};

/// A table of transforms for tests: what was set, or its inverse, at any instant.
class TableSource final : public FrameSource {
 public:
  void set(const std::string& a, const std::string& b, const StampedTransform& X_AB) {
    table_[{a, b}] = X_AB;
  }
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& /*query*/,
                                                Milliseconds /*wait*/) override {
    const auto there = table_.find({std::string(a), std::string(b)});
    if (there != table_.end()) return there->second;
    const auto back = table_.find({std::string(b), std::string(a)});
    if (back == table_.end()) {
      return fail(Errc::kNotConnected,
                  "the table has no transform between " + quote(a) + " and " + quote(b));
    }
    StampedTransform X_AB = back->second;
    static_cast<Transform&>(X_AB) = inverse(X_AB);
    return X_AB;
  }

 private:
  std::map<std::pair<std::string, std::string>, StampedTransform> table_;
};

}  // namespace tfdude
