#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "runtime/deferred.hpp"
#include "runtime/sender.hpp"

namespace tfdude {

/// The streams of a participant, and the thread that updates their destinations.
/// @par Thread safety  All functions are thread-safe.
class Streams {
 public:
  Streams(SenderLinks<Update> of_edges, SenderLinks<JointUpdate> of_joints);
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
    if (Deferred* planner = planning_.load()) planner->ask();
  }

 private:
  template <class Message>
  std::shared_ptr<Sender<Message>> open(const std::vector<std::string>& names,
                                        const SenderLinks<Message>& links);
  void add(const std::shared_ptr<PlannedSender>& sender);
  [[nodiscard]] std::vector<std::shared_ptr<PlannedSender>> senders();

  const SenderLinks<Update> of_edges_;
  const SenderLinks<JointUpdate> of_joints_;
  Mutex mutex_;
  std::vector<std::weak_ptr<PlannedSender>> senders_ TFDUDE_GUARDED_BY(mutex_);
  bool stopped_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::unique_ptr<Deferred> planner_ TFDUDE_GUARDED_BY(mutex_);  // once there is a stream
  std::atomic<Deferred*> planning_{nullptr};
};

}  // namespace tfdude
