#include <tuple>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "partition/requests.hpp"
#include "runtime/participant.hpp"

// What is stored of this participant's partition, and told once it is.
namespace tfdude {

Ready Participant::take() {
  const std::lock_guard lock(structure_.mutex);
  const std::lock_guard joints(joints_mutex_);
  return member_.take_ready();
}

void Participant::publish(const Ready& ready) {
  std::optional<Presence> said;
  {
    const std::lock_guard lock(structure_.mutex);
    said = member_.stored(ready);
  }
  for (const Page& page : ready.pages) transport_->publish(page);
  if (said) transport_->announce(*said);
  structure_.changed.notify_all();
}

void Participant::take_back(const Ready& ready) {
  std::optional<Presence> said;
  {
    const std::lock_guard lock(structure_.mutex);
    const std::lock_guard joints(joints_mutex_);
    said = member_.not_stored(ready);
  }
  if (said) transport_->announce(*said);
}

ChangedValues Participant::take_values() {
  ChangedValues values;
  if (out_) return values;
  values.since = saved_commit_;
  std::tie(values.edges, saved_commit_) = structure_.forest.changed_since(saved_commit_);
  if (values.edges.empty()) return values;
  const std::lock_guard lock(structure_.mutex);
  values.edges = member_.storable(std::move(values.edges));
  const std::lock_guard joints(joints_mutex_);
  values.joints = partition_->take_changed_joints();
  return values;
}

void Participant::take_back(const ChangedValues& values) {
  saved_commit_ = values.since;
  const std::lock_guard lock(joints_mutex_);
  partition_->still_unsaved(values.joints);
}

void Participant::reply(const PendingReply& pending) {
  if (!pending.what.empty()) {
    const auto* error = std::get_if<Error>(&pending.reply.body);
    log().info("{}: {}", pending.what, error != nullptr ? "refused: " + error->message : "done");
  }
  transport_->reply(pending.to, pending.reply);
}

std::optional<Error> Participant::refusal() const {
  auto failure = commits_ ? commits_->failure() : std::nullopt;
  if (!failure) return std::nullopt;
  return Error{failure->code,
               "partition " + quote(partition_name_) +
                   " changes nothing before it can store what it has changed: " + failure->message};
}

Error Participant::unless_unsaved(Error error, const std::string& id) {
  if (error.code != Errc::kAlreadyExists && error.code != Errc::kUnknownFrame) return error;
  auto why = refusal();
  const std::lock_guard lock(structure_.mutex);
  return why && partition_->is_unsaved(id) ? *std::move(why) : error;
}

Result<void> Participant::await_stored(const Request& request, const Deadline& deadline) {
  return is_of_structure(request) && commits_->stores() ? commits_->flush(deadline.at())
                                                        : Result<void>();
}

}  // namespace tfdude
