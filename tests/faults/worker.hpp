#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"

#include "faults/frames.hpp"
#include "faults/journal.hpp"
#include "faults/model.hpp"
#include "support/random.hpp"

namespace tfdude::faults {

/// How many frames all clients change.
inline constexpr std::size_t kContested = 12;

/// A client with its own thread that changes frames and looks them up, and compares each answer
/// with its model.
class Worker {
 public:
  Worker(Client client, std::size_t number, std::size_t partitions, std::uint64_t seed,
         Journal& journal);
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void start();
  void stop();

  // After stop().
  [[nodiscard]] Client& client() { return client_; }
  [[nodiscard]] Model& model() { return model_; }

  /// Empty if a joint has a value that was streamed.
  [[nodiscard]] std::string judge_joint(const std::string& id, const Transform& X_PC) const;
  /// The frames that were streamed, and the bases above them.
  [[nodiscard]] const std::map<std::string, std::string>& joints() const { return joints_; }

 private:
  void run();
  void add_joints();
  void step();

  void add();
  void update();
  void move();
  void remove();
  void look_up();
  void look_up_removed();
  void ask_parent();
  void publish();
  void look_up_joint();
  void contest();

  /// Counts an outcome, and adds it to the history of its frames.
  template <class Value>
  void record(const std::string& operation, const std::vector<std::string>& frames,
              const std::string& details, const Result<Value>& result);
  /// The service denies something that is true. That is allowed only while there are faults,
  /// because a replica may then not be up to date.
  void denied(const std::string& what, const std::string& frame);
  void contradiction(const std::string& what, const std::string& frame);
  [[nodiscard]] std::vector<std::string> own(bool anchored) const;
  /// Whether each requested change was made or will never be made, and this client knows which.
  [[nodiscard]] bool quiet();
  [[nodiscard]] std::string any(const std::vector<std::string>& ids) {
    return ids[random_.index(ids.size())];
  }
  [[nodiscard]] std::string any_base() { return base_of(random_.index(partitions_)); }
  [[nodiscard]] std::string any_anchor();

  Client client_;
  const std::string prefix_;
  const std::size_t number_;
  const std::size_t partitions_;
  testing::Random random_;
  Journal& journal_;
  Model model_;
  std::size_t added_ = 0;
  std::deque<std::string> removed_;  // the latest
  std::map<std::string, std::string> joints_;
  std::uint32_t streamed_ = 0;
  double calm_ = 0;  // when the operation began
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace tfdude::faults
