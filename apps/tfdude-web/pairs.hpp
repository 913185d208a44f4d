#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "tfdude/client/client.hpp"

#include "../worker.hpp"

// The poses that pages ask for. Each is followed once, however many pages show it.
namespace tfdude::web {

using Text = std::shared_ptr<const std::string>;

/// What is known of B in A, as the command line prints it in JSON, or the reason why there is none.
class Pair {
 public:
  Pair(std::string a, std::string b) : a_(std::move(a)), b_(std::move(b)) {}

  [[nodiscard]] const std::string& a() const { return a_; }
  [[nodiscard]] const std::string& b() const { return b_; }
  /// Changes with each answer.
  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] Text answer() const { return answer_; }

 private:
  friend class Pairs;

  const std::string a_;
  const std::string b_;
  // Of the server's thread.
  std::uint64_t number_ = 0;
  Text answer_;
  std::optional<std::uint64_t> seen_;  // messages of the watch
  std::chrono::steady_clock::time_point next_{};
  // Of both threads.
  std::mutex mutex_;
  std::optional<PathWatch> watch_;
  std::optional<Error> error_;  // why there is none
  bool asked_ = false;
};

class Pairs {
 public:
  Pairs(Client& client, cli::Worker& worker, double rate)
      : client_(client), worker_(worker), rate_(rate) {}

  /// Follows a pair while the result exists. On the server's thread.
  [[nodiscard]] std::shared_ptr<Pair> follow(const std::string& a, const std::string& b);
  /// Renews the answers; on the server's thread.
  void tick();
  /// Calls the function for each pair that is followed.
  void each(const std::function<void(const Pair&)>& see) const;

  /// The answer for an instant. Waits for the owners.
  [[nodiscard]] Text answer_at(const std::string& a, const std::string& b, Time instant) const;
  /// Why the answer is as it is, or why there is none; absent: now. Waits for the owners.
  [[nodiscard]] Text explained(const std::string& a, const std::string& b,
                               const std::optional<Time>& instant) const;

 private:
  void renew(Pair& pair);
  void begin(const std::shared_ptr<Pair>& pair);
  [[nodiscard]] Text text_of(const std::string& a, const std::string& b,
                             const Result<StampedTransform>& X_AB, bool past,
                             const std::string& unreachable) const;

  Client& client_;
  cli::Worker& worker_;
  const double rate_;
  std::map<std::pair<std::string, std::string>, std::weak_ptr<Pair>> pairs_;
};

}  // namespace tfdude::web
