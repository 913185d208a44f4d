#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "partition/messages.hpp"
#include "simulation/plan.hpp"
#include "simulation/timeline.hpp"
#include "simulation/traffic.hpp"

namespace tfdude::simulation {

class Process;

/// Samples that are sent reliably, the newest of each key; participants that join later get it,
/// too.
using Sample = std::variant<Presence, Page>;

/// The computers and the network between them.
class Network {
 public:
  Network(Timeline& timeline, const Plan& plan)
      : timeline_(timeline),
        plan_(plan),
        loss_(plan.loss),
        random_(plan.seed ^ 0x6e657477U),
        hosts_(kMostHosts) {}

  /// From now on what is sent is counted.
  void count(Traffic& traffic) { traffic_ = &traffic; }

  void join(const std::shared_ptr<Process>& process);
  /// Null: it has ended.
  [[nodiscard]] std::shared_ptr<Process> find(std::uint64_t process) const;

  /// Sends a datagram, which may be lost, arrive twice, or be overtaken.
  void send(const Process& from, std::uint64_t to, const Message& message,
            std::function<void(Process&)> arrival);
  /// To all who are met.
  void publish(const Process& from, const Sample& sample);

  /// Whether an announcement of that process is heard now.
  [[nodiscard]] bool announces(std::uint64_t from, const Process& to);
  /// Whether that process, asked for a sign of life, gives one.
  [[nodiscard]] bool answers(std::uint64_t from, const Process& to);
  /// Whose samples reach that process.
  [[nodiscard]] std::vector<std::uint64_t> met_by(const Process& one) const;

  /// A datagram that has not arrived by then is lost, or waits for a process that hangs.
  [[nodiscard]] Instant longest_delay() const;

  // Faults; counted, as several may concern one link.
  void cut_in(std::size_t host, int change) { hosts_[host].deaf += change; }
  void cut_out(std::size_t host, int change) { hosts_[host].mute += change; }
  void part(std::size_t a, std::size_t b, int change) { parted_[std::minmax(a, b)] += change; }

  /// From now on this share is lost on the way.
  void set_loss(double loss) { loss_ = loss; }

  static constexpr std::size_t kMostHosts = 64;

 private:
  struct Host {
    int deaf = 0;
    int mute = 0;
  };
  struct Channel {
    std::list<Sample> waiting;
    bool moving = false;
  };
  using Way = std::pair<std::uint64_t, std::uint64_t>;

  [[nodiscard]] bool reaches(std::size_t from, std::size_t to) const;
  [[nodiscard]] bool shows_life(std::uint64_t from, const Process& to);
  [[nodiscard]] Instant delay();
  void meet(std::uint64_t a, std::uint64_t b);
  void open(const Process& from, std::uint64_t to);
  void put(Channel& channel, const Sample& sample);
  void move(const Way& way);
  void arrive(const Way& way);

  Timeline& timeline_;
  const Plan& plan_;
  double loss_;
  testing::Random random_;
  std::vector<Host> hosts_;
  std::map<std::pair<std::size_t, std::size_t>, int> parted_;
  std::map<std::uint64_t, std::weak_ptr<Process>> processes_;
  std::map<Way, Channel> channels_;
  std::set<Way> backwards_;  // the same ways, by receiver
  Traffic* traffic_ = nullptr;
};

}  // namespace tfdude::simulation
