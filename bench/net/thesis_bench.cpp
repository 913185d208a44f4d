// Repeats the thesis's experiments of section 5.2.3. Each call is measured centralized (one daemon
// owns all frames, this process is a plain client of it) and decentralized (this process owns its
// partition of the example tree, a daemon the other one), in turns.
//
//   thesis_bench --as robot|arms --config FILE --central DOMAIN --domain DOMAIN --profile FILE
//                --calls N --repetitions R
//
// bench/net_stage.py starts the daemons: that of all frames in CENTRAL, that of the other partition
// in DOMAIN.
// Keys: thesis/CASE/AS/DEPLOYMENT, where AS is the process that asks.
//
//   figure  what the thesis measured                             key
//   5.1     add tool to camera, in main                          add_own/robot
//   5.2     add a hand to arm_2, in main                         add_other/robot
//   5.3     remove what 5.1 added                                remove_own/robot
//   5.4     remove what 5.2 added                                remove_other/robot
//   5.5     get path world to hand_left, in main                 path_across/robot
//   5.6     get path world to robot_1, in the arms' process      path_other/arms
//   5.7     get path world to robot_1, in main                   path_own/robot
//   5.8     update a frame of the arms, in main                  update_other/robot
//   5.9     update a frame of the arms, in the arms' process     update_own/arms
//   5.10    update robot_1, in main                              update_own/robot
//   5.11    update the connection (arm_1, below robot_1)         update_connector/robot and /arms
//
// "main" is the thesis's process of world and robot; here it is the partition robot. The thesis
// does not have the other pairs, such as add_own/arms. They show that it does not matter which
// process asks, and are measured with fewer calls.

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "tfdude/client/node.hpp"

#include "net/harness.hpp"

namespace {

using bench::Arguments;
using bench::check;
using bench::must;
using tfdude::Client;
using tfdude::Transform;

// Calls on own frames take fractions of a microsecond, about as long as reading the clock.
constexpr int kOwnBatch = 32;

/// The frames that each case uses, by the asking process.
struct Role {
  const char* own_parent;  // of the leaf that is added
  const char* other_parent;
  std::pair<const char*, const char*> own_path;
  std::pair<const char*, const char*> other_path;
  const char* own_frame;  // to be updated
  const char* other_frame;
};

constexpr Role kRobot{"camera",  "arm_2", {"world", "robot_1"}, {"arm_1", "hand_left"},
                      "robot_1", "arm_2"};
constexpr Role kArms{"arm_2", "camera", {"arm_1", "hand_left"}, {"world", "robot_1"},
                     "arm_2", "robot_1"};

// The cases of the thesis, as in the table.
const std::set<std::string> kFigures{
    "add_own/robot",          "add_other/robot",      "path_across/robot", "path_other/arms",
    "path_own/robot",         "update_other/robot",   "update_own/arms",   "update_own/robot",
    "update_connector/robot", "update_connector/arms"};
constexpr int kFewer = 6;

class ThesisBench {
 public:
  ThesisBench(Client& central, Client& decentral, std::string as, bench::Extent extent)
      : central_(central), decentral_(decentral), as_(std::move(as)), extent_(extent) {
    X_ = must(central_.lookup("robot_1", "robot_2"), "a transform to work with");
  }

  void run() const {
    const Role& role = as_ == "robot" ? kRobot : kArms;
    compare_add_and_remove("own", role.own_parent);
    compare_add_and_remove("other", role.other_parent);
    compare_path("path_across", {"world", "hand_left"}, 1);
    compare_path("path_other", role.other_path, 1);
    compare_path("path_own", role.own_path, kOwnBatch);
    compare_update("update_other", role.other_frame, 1);
    compare_update("update_own", role.own_frame, kOwnBatch);
    compare_update("update_connector", "arm_1", as_ == "arms" ? kOwnBatch : 1);
  }

 private:
  [[nodiscard]] std::string key(const std::string& what, const char* deployment) const {
    return "thesis/" + what + "/" + as_ + "/" + deployment;
  }

  [[nodiscard]] bench::Extent extent(const std::string& what) const {
    bench::Extent extent = extent_;
    if (kFigures.count(what + "/" + as_) == 0) extent.calls = std::max(extent.calls / kFewer, 1);
    return extent;
  }

  /// @param batch  of the decentralized calls
  template <class Operation>
  void compare(const std::string& what, Operation operation, int batch) const {
    bench::measure({bench::turn(key(what, "centralized"), [=] { operation(central_); }),
                    bench::turn(
                        key(what, "decentralized"), [=] { operation(decentral_); }, batch)},
                   extent_);
  }

  void compare_path(const std::string& what, std::pair<const char*, const char*> ends,
                    int batch) const {
    compare(
        what, [=](Client& client) { check(client.lookup(ends.first, ends.second), "lookup"); },
        batch);
  }

  void compare_update(const std::string& what, const std::string& frame, int batch) const {
    compare(
        what, [=](Client& client) { check(client.update(frame, X_), "update"); }, batch);
  }

  // Adds and removes in turns, so that the tree stays the same.
  void compare_add_and_remove(const std::string& whose, const std::string& parent) const {
    const auto turn = [&](Client& client, const char* deployment) -> bench::Turn {
      return {{bench::Series(key("add_" + whose, deployment), "us"),
               bench::Series(key("remove_" + whose, deployment), "us")},
              [this, parent, &client](double* values) {
                static const std::string leaf = "tool";
                const auto start = bench::Clock::now();
                check(client.add(leaf, parent, X_), "add");
                values[0] = bench::microseconds_since(start);
                const auto added = bench::Clock::now();
                check(client.remove(leaf), "remove");
                values[1] = bench::microseconds_since(added);
              }};
    };
    bench::measure({turn(central_, "centralized"), turn(decentral_, "decentralized")},
                   extent("add_" + whose));
  }

  Client& central_;
  Client& decentral_;
  const std::string as_;
  const bench::Extent extent_;
  Transform X_;
};

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  const auto config = must(tfdude::load_config(arguments.text("config")), "the configuration");
  auto central = must(Client::open(arguments.options("central")), "the centralized deployment");
  auto node = must(tfdude::Node::open(config.partition, config.frames, arguments.options("domain")),
                   "the decentralized deployment");
  // Waits until all frames are known, before measuring.
  for (Client* client : {&central, static_cast<Client*>(&node)}) {
    (void)bench::await_lookup(*client, "world", "hand_left");
  }
  ThesisBench(central, node, arguments.text("as"),
              {arguments.number("calls"), arguments.number("repetitions")})
      .run();
  return 0;
}
