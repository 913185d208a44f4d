#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "runtime/sender.hpp"
#include "simulation/cast.hpp"
#include "simulation/planned.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {

/// A stream of a client, as Streams runs it: it plans again when the routes may have changed.
/// @tparam Message  Update or JointUpdate
template <class Message>
class Stream : public Planned, public std::enable_shared_from_this<Stream<Message>> {
 public:
  Stream(Process& process, std::vector<std::string> names,
         std::shared_ptr<SenderLinks<Message>> links)
      : process_(process),
        names_(std::move(names)),
        links_(links),
        sender_(std::make_shared<Sender<Message>>(names_, std::move(links))) {}

  void start() {
    process_.keep_planned(this->shared_from_this());
    begin();
    sender_->plan();
  }
  /// Sends the value of all. @return the indices of those that were not sent
  template <class Fill>
  std::set<std::size_t> send(Fill fill) {
    std::set<std::size_t> indices;
    const auto valid = [](std::size_t) { return true; };
    for (const NotSent& one : sender_->send({}, valid, fill)) indices.insert(one.index);
    return indices;
  }

 private:
  [[nodiscard]] std::string plan() const override {
    std::string text;
    for (const Destinations& owners : links_->find(names_)) {
      text += text.empty() ? "" : ", ";
      for (const Destination& one : owners.to)
        text += one.partition + (one.reachable ? " " : " (gone) ");
    }
    return text;
  }
  [[nodiscard]] bool hears(const Told& told) const override { return told.routes; }
  [[nodiscard]] std::string name() const override { return "a stream of " + names_.front(); }
  void renew() override {
    process_.later("plan a stream", milliseconds(1), [sender = sender_] { sender->plan(); });
  }

  Process& process_;
  const std::vector<std::string> names_;
  const std::shared_ptr<SenderLinks<Message>> links_;
  std::shared_ptr<Sender<Message>> sender_;
};

/// A client that continuously streams edges and joints that come and go with the configurations of
/// their owners. In calm, those that exist must get there, and no others are counted as sent.
class Streamer : public std::enable_shared_from_this<Streamer> {
 public:
  explicit Streamer(std::shared_ptr<Process> process);

  void start();
  /// The last values have arrived, and were counted properly.
  void check(const Cast& cast);

  [[nodiscard]] Process& process() { return *process_; }

 private:
  void next();
  void check_edge(std::size_t owner, const Cast& cast);
  void check_joint(std::size_t owner, const Cast& cast);
  [[nodiscard]] bool is_recent(double value) const;

  std::shared_ptr<Process> process_;
  std::shared_ptr<Stream<Update>> edges_;
  std::shared_ptr<Stream<JointUpdate>> joints_;
  std::set<std::size_t> edges_not_sent_;  // of the last sample, by owner
  std::set<std::size_t> joints_not_sent_;
  std::size_t sent_ = 0;
};

}  // namespace tfdude::simulation
