#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "runtime/context.hpp"
#include "runtime/sender.hpp"

namespace tfdude {

/// The streams of a participant, and the job that updates their destinations.
/// @par Thread safety  All functions are thread-safe.
class Streams {
 public:
  explicit Streams(const Context& context);
  ~Streams() { stop(); }
  Streams(const Streams&) = delete;
  Streams& operator=(const Streams&) = delete;

  /// After it has returned all streams send nothing, and use nothing of the participant.
  void stop();

  /// @return kInvalidInput: an invalid or duplicate id; more than kMaxItems.
  [[nodiscard]] Result<std::shared_ptr<Sender<Update>>> edges(const std::vector<std::string>& ids);
  [[nodiscard]] Result<std::shared_ptr<Sender<JointUpdate>>> joints(
      const std::vector<std::string>& names);

  /// What a plan would find has changed.
  void look_again() {
    if (opened_.load(std::memory_order_relaxed)) plans_.ask();
  }

 private:
  template <class Message>
  std::shared_ptr<Sender<Message>> open(const std::vector<std::string>& names,
                                        const std::shared_ptr<SenderLinks<Message>>& links);
  void add(const std::shared_ptr<PlannedSender>& sender);
  [[nodiscard]] std::vector<std::shared_ptr<PlannedSender>> senders();

  const std::shared_ptr<SenderLinks<Update>> of_edges_;
  const std::shared_ptr<SenderLinks<JointUpdate>> of_joints_;
  Mutex mutex_;
  std::vector<std::weak_ptr<PlannedSender>> senders_ TFDUDE_GUARDED_BY(mutex_);
  bool stopped_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::atomic<bool> opened_{false};  // any
  Loop::Job plans_;                  // last: it uses the other members
};

}  // namespace tfdude
