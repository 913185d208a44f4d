// Gives an owner any file as its stored state. A rejected file must not change. An accepted state
// must be fit to be served, published, and stored again.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include "fuzz/demand.hpp"
#include "fuzz/forest_checks.hpp"
#include "fuzz/state_rows.hpp"
#include "fuzz/wire.hpp"
#include "math/flat.hpp"
#include "partition/partition.hpp"
#include "store/correlation_blob.hpp"
#include "store/sqlite_store.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPartition = "arms";

// A folder in memory, which disappears with the process.
class Folder {
 public:
  Folder() {
    const fs::path memory = "/dev/shm";
    path_ = (fs::is_directory(memory) ? memory : fs::temp_directory_path()) /
            ("tfdude-fuzz-" + std::to_string(getpid()));
    fs::create_directory(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { fs::remove_all(path_); }

  void clear() const {
    for (const auto& entry : fs::directory_iterator(path_)) fs::remove_all(entry);
  }
  [[nodiscard]] std::string file() const { return path_ / "state.sqlite"; }

 private:
  fs::path path_;
};

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const std::string& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

// "id < parent, Lamport time, value" of each frame of a state.
std::vector<std::string> lines_of(const StoredState& state) {
  std::vector<std::string> lines{"epoch " + std::to_string(state.epoch)};
  const auto bits = [](const Transform& X) {
    const Flat flat = to_flat(X);
    return std::string(reinterpret_cast<const char*>(flat.data()), sizeof flat);
  };
  const auto correlation = [](const StoredCorrelation& kept) {
    return to_blob(kept.said) + observed_blob(kept);
  };
  for (const StoredFrame& frame : state.frames) {
    lines.push_back("frame " + frame.id + " < " + frame.parent + ", " +
                    std::to_string(frame.lamport_time) + ", " + bits(frame.X_PC) +
                    correlation(frame.correlation));
  }
  for (const Tombstone& tombstone : state.tombstones) {
    lines.push_back("tombstone " + tombstone.id + ", " + std::to_string(tombstone.lamport_time) +
                    ", " + std::to_string(static_cast<int>(tombstone.kind)) + ", " +
                    tombstone.rival);
  }
  for (const FrameSpec& frame : state.configured) {
    lines.push_back("configured " + frame.id + " < " + frame.parent + ", " + bits(frame.X_PC) +
                    to_blob(frame.correlation));
  }
  for (const StoredJoint& joint : state.joints) {
    lines.push_back("joint " + joint.name + ", " + std::to_string(joint.position) + ", " +
                    std::to_string(joint.variance.value_or(-1)) +
                    (joint.type ? to_string(*joint.type) : ""));
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

StateChange all_of(const StoredState& state) {
  StateChange change{state.epoch, {}, state.frames, state.tombstones, state.joints};
  for (const StoredFrame& frame : state.frames) change.erased.push_back(frame.id);
  for (const Tombstone& tombstone : state.tombstones) change.erased.push_back(tombstone.id);
  change.configured = state.configured;
  return change;
}

// Others accept all published pages, and no stored frame is lost.
void demand_served(const StoredState& state) {
  testing::Replica replica(kPartition);
  Partition partition(kPartition, 1, replica.forest, replica.directory);
  demand(partition.restore(state, state.configured, Time{}).has_value(), "what was left is taken");
  demand(partition.frame_count() == state.frames.size(), "all frames are there again");
  demand_consistent(replica.forest);
  testing::Replica hearer;
  for (const Page& page : partition.take_pages()) {
    const auto arrived = fastdds::from_wire(travelled<fastdds::PageType>(fastdds::to_wire(page)));
    demand(arrived.has_value(), "what is published is understood");
    hearer.directory.apply(*arrived);
  }
  demand(hearer.structure() == replica.structure(), "others see what is there");
  const Reply reply = partition.answer({1, "a new one", AddRequest{"", {}}}, Time{});
  demand(std::holds_alternative<Error>(reply.body) || reply.epoch > state.epoch,
         "a change has a later epoch than all before");
}

std::optional<StoredState> loaded(StateStore& store) {
  auto state = store.load();
  if (state) return *std::move(state);
  demand(state.error().code == Errc::kState, "the state is to blame");
  demand_printable(state.error());
  return std::nullopt;
}

bool accepted(const std::string& file) {
  const auto store = open_sqlite_store(file, kPartition);
  if (!store) {
    demand(store.error().code == Errc::kState, "the state is to blame");
    demand_printable(store.error());
    return false;
  }
  const auto state = loaded(**store);
  if (!state) return false;
  demand_served(*state);
  demand((*store)->save(all_of(*state)).has_value(), "what was read can be stored");
  const auto again = loaded(**store);
  demand(again && lines_of(*again) == lines_of(*state), "what was stored is what was read");
  return true;
}

void demand_kept(const std::string& file) {
  const auto store = open_sqlite_store(file, kPartition);
  demand(store.has_value() && loaded(**store).has_value(), "what was accepted is accepted again");
}

void run_file(const Folder& folder, std::string_view bytes, const char* log) {
  const std::string file = folder.file();
  // The log's size in pages of 512 bytes and its header: what is left is the file.
  std::string_view beside;
  if (log != nullptr && bytes.size() > 2) {
    const auto size =
        static_cast<unsigned char>(bytes[0]) * 256U + static_cast<unsigned char>(bytes[1]);
    bytes.remove_prefix(2);
    beside = bytes.substr(bytes.size() - std::min<std::size_t>(size, bytes.size()));
    bytes.remove_suffix(beside.size());
    write(file + log, beside);
  }
  write(file, bytes);
  const bool rolls_back = log != nullptr && log == std::string_view("-journal");
  if (accepted(file)) {
    demand_kept(file);
  } else if (!rolls_back && !bytes.empty()) {
    demand(content(file) == bytes, "a file that is refused is not changed");
    demand(content(file + "-wal") == beside, "nor is its log");
  }
}

void run(const std::string& bytes) {
  static const Folder folder;
  folder.clear();
  if (bytes.empty()) return;
  const std::string_view rest = std::string_view(bytes).substr(1);
  switch (bytes[0] % 4) {
    case 0:
      run_file(folder, rest, nullptr);
      break;
    case 1:
      run_file(folder, rest, "-wal");
      break;
    case 2:
      run_file(folder, rest, "-journal");
      break;
    default: {
      FuzzedDataProvider choices(reinterpret_cast<const std::uint8_t*>(rest.data()), rest.size());
      demand(open_sqlite_store(folder.file(), kPartition).has_value(), "a new file is made");
      put_rows(folder.file(), choices);
      const std::string before = content(folder.file());
      if (accepted(folder.file())) {
        demand_kept(folder.file());
      } else {
        demand(content(folder.file()) == before, "a file that is refused is not changed");
      }
    }
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
