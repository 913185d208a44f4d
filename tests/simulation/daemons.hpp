#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "simulation/cast.hpp"
#include "simulation/clock.hpp"
#include "simulation/disk.hpp"

namespace tfdude::simulation {

/// The daemons of a run, with their disks and clocks, and the faults that happen to them.
class Daemons {
 public:
  /// @param first  of the partition's changes that its disk has lost
  using LostPower = std::function<void(const std::string& partition, Instant first)>;

  /// @param clocks  by computer
  Daemons(Surroundings& world, Cast& cast, std::vector<Clock>& clocks, LostPower lost_power);

  /// Starts all, and from now on those that end by themselves.
  void start();
  void begin(const Fault& fault);
  void end(const Fault& fault);

  /// A daemon that hung, and in whose place another one runs; null: none.
  [[nodiscard]] const Process* replaced() const { return replaced_.get(); }
  [[nodiscard]] std::uint64_t next_process() { return ++processes_; }

 private:
  [[nodiscard]] std::size_t disk_number(std::size_t owner) const;
  [[nodiscard]] Disk* disk_of(std::size_t owner);
  [[nodiscard]] std::vector<FrameSpec> configuration(std::size_t owner) const;
  void start(std::size_t owner, Disk* disk);
  void look_after();
  void replace(const Fault& fault);
  void pause(const Fault& fault);
  void take_down(std::size_t owner, bool gently);
  void bring_up(std::size_t owner);
  void lose_power(std::size_t owner);
  void stands(const Fault& fault);

  Surroundings& world_;
  Cast& cast_;
  std::vector<Clock>& clocks_;
  const LostPower lost_power_;
  std::vector<Disk> disks_;  // the last is the renamed one's
  std::vector<int> down_;    // by how many faults
  std::map<const Fault*, std::weak_ptr<Process>> hung_;
  std::shared_ptr<Process> replaced_;  // the wild daemon, while it hangs
  const Fault* replaced_by_ = nullptr;
  std::uint64_t processes_ = 0;
};

}  // namespace tfdude::simulation
