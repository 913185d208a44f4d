#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "partition/messages.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Checks whether a request can be watched. @return kInvalidInput (the period).
[[nodiscard]] Result<void> check_watch(const WatchRequest& request);

/// An owner's side of the numbers that stand for covariances which a group was sent before: an edge
/// whose covariance stays the same costs a quarter of the bytes. One that is not complete has no
/// number.
class CovarianceNumbers {
 public:
  explicit CovarianceNumbers(std::size_t edges) : told_(edges) {}

  /// For a value that all of the group are sent: gives it the number of its covariance, and omits
  /// that if the group was sent it last.
  void push(PushedValue& value);
  /// For a value that some may be sent alone: its covariance always comes with it.
  void label(PushedValue& value) const;

 private:
  struct Told {
    std::uint32_t number = 0;  // 0: nothing yet
    Covariance::Upper covariance{};
  };
  std::vector<Told> told_;  // last, by index
};

/// A watcher's side of these numbers.
class KnownCovariances {
 public:
  explicit KnownCovariances(std::size_t edges) : known_(edges) {}

  /// Fills in the covariances that were omitted, and drops the values for which that is not known.
  /// @return whether all were known
  [[nodiscard]] bool fill_in(std::vector<PushedValue>& values);

 private:
  [[nodiscard]] bool fill_in(PushedValue& value);

  struct Known {
    std::uint32_t number = 0;
    Covariance covariance;
  };
  std::vector<Known> known_;  // the last received, by index
};

/// An owner's side of one group of watchers: which values they have not been sent yet. Not
/// thread-safe; the forest is.
class WatchedGroup {
 public:
  WatchedGroup(std::uint64_t id, WatchRequest request);

  [[nodiscard]] const WatchRequest& request() const { return request_; }

  /// All watched values as of now; does not change what next_push() returns.
  /// @param from  as WatchRequest::from; if there are more samples than fit a message, only the
  ///   newest are sent
  /// @return kNotOwner (naming the frame) if an edge is not held, or has another parent;
  ///   kInvalidInput for a composed segment that has process noise: its covariance would be too
  ///   small between samples.
  /// @param is_answer  it may arrive before what was pushed already
  [[nodiscard]] Result<PushedValues> snapshot(const Forest& forest, std::optional<Time> from,
                                              bool is_answer = false) const;

  /// The first watcher was told this, a snapshot().
  void begin(const PushedValues& told);

  /// Values written since the last call: all samples, or the newest of each edge if the watchers
  /// want a lower rate. The first has all edges, so that it may come before the reply, and the
  /// samples since begin(). Empty while an edge is not held, or has another parent: the watchers
  /// then use another route.
  [[nodiscard]] PushedValues next_push(const Forest& forest);
  /// Whether a push has told of a past that was rewritten, which may not have arrived yet.
  [[nodiscard]] bool has_rewritten() const { return !rewritten_.empty(); }
  /// All pushes have arrived.
  void arrived() { rewritten_.clear(); }

 private:
  [[nodiscard]] std::vector<EdgeCursor> fresh_cursors() const;
  [[nodiscard]] Result<PushedValues> composed(const Forest& forest, std::optional<Time> from) const;
  [[nodiscard]] Result<PushedValues> all(const Forest& forest, std::optional<Time> from) const;
  void leave_out_pending(PushedValues& pushed, bool on_its_way) const;
  void note_rewritten(const std::vector<PushedValue>& values);
  /// Whether nothing of its history was sent yet.
  [[nodiscard]] bool begins(const PushedValue& entry) const;
  [[nodiscard]] bool is_new(const PushedValue& entry) const;
  [[nodiscard]] PushedValues next_composed_push(const Forest& forest);
  [[nodiscard]] PushedValues changed(const Forest& forest);

  std::uint64_t id_;
  WatchRequest request_;
  std::uint64_t told_ = 0;  // commit of the last push
  // Edges whose past was rewritten, as a push says that has not.
  std::vector<std::uint32_t> rewritten_;
  // What the first watcher was told of composed segments.
  SeenSegments begun_{0, Time::min(), true};
  std::vector<EdgeCursor> cursors_;               // by edge
  std::vector<std::optional<PushedValue>> sent_;  // by composed segment
  std::optional<std::uint64_t> said_;             // SegmentValues::said of these
  CovarianceNumbers numbers_;
};

/// Whether these values are a snapshot(), and not what a push has told since the one before.
[[nodiscard]] inline bool is_answer(const PushedValues& values) {
  return values.after == 0 || values.after == values.commit;
}

/// The first sample of each edge that the values have one of, in their order.
/// @param edges  how many edges there may be
[[nodiscard]] std::vector<const PushedValue*> first_samples(const PushedValues& values,
                                                            std::size_t edges);

/// Splits the values into pieces that fit into a message.
[[nodiscard]] std::vector<PushedValues> pieces_of(PushedValues&& pushed);

/// Reassembles pieces, which come in order or not at all.
/// @par Memory  Limited by kMost. Values beyond it are as good as lost: the watcher asks for all.
class PushedPieces {
 public:
  /// Values of one push, with the common errors that are said of them: four edges that were each
  /// rewritten as far as one rewrite goes.
  static constexpr std::size_t kMost = 4 * std::size_t{kMaxRewritten};

  /// @return all values, once the last piece has come
  [[nodiscard]] std::optional<PushedValues> add(const PushedValues& piece);

 private:
  void drop();

  PushedValues whole_;
  std::uint32_t next_ = 0;
  std::size_t size_ = 0;  // counted as kMost
};

/// A watcher's side of one group: puts together what comes of it, and notices what was lost.
class ReceivedGroup {
 public:
  /// How values continue those before.
  struct Place {
    bool is_old = false;      ///< everything up to their commit was known
    bool follows_on = false;  ///< nothing is missing before them
  };

  explicit ReceivedGroup(std::size_t edges) : covariances_(edges) {}

  /// @return all values of a message, once its last piece has come. place() or skip() follows.
  [[nodiscard]] std::optional<PushedValues> whole(const PushedValues& piece) {
    return pieces_.add(piece);
  }
  /// The values are used: completes them.
  [[nodiscard]] Place place(PushedValues& whole);
  /// The values are left out, so they are missing.
  void skip(const PushedValues& whole);

  /// Whether all values have come once.
  [[nodiscard]] bool answered() const { return commit_ != 0; }
  /// Whether a message was lost, or has come before an earlier one.
  [[nodiscard]] bool lacks() const { return commit_ == 0 || heard_ > commit_; }
  /// Whether less has come than of another one.
  [[nodiscard]] bool is_behind(const ReceivedGroup& other) const {
    return commit_ < std::max(other.commit_, other.heard_);
  }

 private:
  PushedPieces pieces_;
  KnownCovariances covariances_;
  std::uint64_t commit_ = 0;  // of the owner: complete up to this commit; 0: nothing yet
  std::uint64_t heard_ = 0;   // the newest commit of which anything has come
};

}  // namespace tfdude
