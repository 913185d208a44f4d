#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

#include "../worker.hpp"
#include "pairs.hpp"
#include "world.hpp"

namespace tfdude::web {

/// A change of the structure, or a remark about an edge, with its number.
struct Event {
  std::uint64_t number = 0;
  Time time;
  std::string level;  ///< "info", "warning"
  nlohmann::json json;
};

/// The robot as it is now: follows all partitions of a domain, once for all pages.
class Live {
 public:
  /// @param rate  of pictures, and the owners' highest rate of sending [Hz]
  /// @return the errors of Client::open()
  [[nodiscard]] static Result<std::unique_ptr<Live>> open(const Options& options, double rate);
  ~Live();
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  [[nodiscard]] World& world() { return world_; }
  [[nodiscard]] cli::Worker& worker() { return worker_; }

  // On the server's thread:

  [[nodiscard]] Pairs& pairs() { return pairs_; }
  /// Ends a picture.
  void tick();
  /// The number of the last picture.
  [[nodiscard]] std::uint64_t picture() const { return picture_; }
  /// The structure, and what changed after a picture; null if nothing has. Texts for the last
  /// picture are made once.
  [[nodiscard]] Text structure();
  [[nodiscard]] Text values_since(std::uint64_t picture);
  [[nodiscard]] Text covariances_since(std::uint64_t picture);
  /// The clock of stamps. Of an external one, the newest stamp.
  [[nodiscard]] Time now();
  [[nodiscard]] std::uint32_t structure_number() const { return structure_.first; }

  // On any thread:

  /// Somebody begins (1) or ceases (-1) to look. Meanwhile rates are asked for once a second, and
  /// joints five times.
  void count_viewer(int change) { viewers_ += change; }
  /// Rates, rejected samples, partitions: all of it, and what has changed. The number counts
  /// changes.
  [[nodiscard]] Text status() const;
  [[nodiscard]] std::pair<std::uint64_t, Text> status_change() const;
  /// All joints. The number counts changes.
  [[nodiscard]] std::pair<std::uint64_t, Text> joints() const;
  [[nodiscard]] std::vector<Event> events_after(std::uint64_t number) const;

 private:
  Live(Client client, ClockKind clock, double rate);

  void follow_partitions();
  void ask_status();
  void ask_joints();
  void note_rejected(const std::string& partition, const HistoryInfo& history);
  void add_event(const Change& change);
  void add_event(Event event);
  Text made_since(std::uint64_t picture, std::map<std::uint64_t, Text>& made,
                  std::string (World::*make)(std::uint64_t, Time) const);

  const ClockKind clock_;
  const double rate_;
  World world_;
  Client client_;
  cli::Worker worker_{256};
  Pairs pairs_;
  std::atomic<int> viewers_{0};

  // Of the server's thread.
  std::uint64_t picture_ = 0;
  std::uint64_t ticks_ = 0;
  std::pair<std::uint32_t, Text> structure_;
  std::map<std::uint64_t, Text> values_;
  std::map<std::uint64_t, Text> covariances_;

  // Of the worker's thread.
  std::map<std::string, PartitionWatch> watches_;
  std::map<std::string, std::uint64_t> rejected_;

  mutable std::mutex mutex_;
  std::deque<Event> events_;
  std::uint64_t last_event_ = 0;
  nlohmann::json edges_ = nlohmann::json::object();
  nlohmann::json partitions_ = nlohmann::json::array();
  std::pair<std::uint64_t, Text> change_;
  std::pair<std::uint64_t, Text> joints_;

  Subscription changes_;  // last: it calls into all of the above
};

}  // namespace tfdude::web
