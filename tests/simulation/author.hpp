#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "faults/frames.hpp"
#include "faults/model.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {

/// Number of frames that all clients change.
inline constexpr std::size_t kContested = 4;

/// A client that makes one call after the other and knows the possible results. It knows all about
/// its own frames, because no other client changes them.
class Author : public std::enable_shared_from_this<Author> {
 public:
  /// @param owners  whose partitions it uses; none of them is renamed
  Author(std::shared_ptr<Process> process, std::size_t number, std::size_t owners,
         std::uint64_t seed);

  /// Goes on until stop().
  void start();
  void stop() { stopped_ = true; }
  /// How many frames of its own it has tried to add.
  [[nodiscard]] std::size_t added() const { return added_; }

  [[nodiscard]] faults::Model& model() { return model_; }
  [[nodiscard]] Process& process() { return *process_; }
  [[nodiscard]] const std::map<std::string, std::size_t>& outcomes() const { return outcomes_; }

  /// Looks up b in a, and judges that.
  void look_up(const std::string& a, const std::string& b, bool quiet);

 private:
  void next();
  void step();
  void add();
  void move();
  void update();
  void remove();
  void contest();
  void begin(const std::string& what, Operation::Route route,
             std::function<void(const Result<void>&)> then);
  void doubt_unless_stored(const std::string& id, const Result<void>& outcome);
  void check_seen(const std::string& id, const std::string& parent);
  [[nodiscard]] std::vector<std::string> own(bool anchored) const;
  [[nodiscard]] std::string any(const std::vector<std::string>& ids);
  [[nodiscard]] std::string any_anchor();

  std::shared_ptr<Process> process_;
  std::string prefix_;
  std::size_t owners_;
  testing::Random random_;
  faults::Model model_;
  std::map<std::string, std::size_t> outcomes_;
  std::size_t added_ = 0;
  bool stopped_ = false;
};

}  // namespace tfdude::simulation
