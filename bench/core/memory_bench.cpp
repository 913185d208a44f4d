// The memory of frames without a history: at their owner, and in the replica of another
// participant. Prints the bytes that one frame takes on the heap.
//
//   memory_bench

#include <cstddef>
#include <functional>
#include <malloc.h>
#include <memory>
#include <string>
#include <vector>

#include "partition/directory.hpp"
#include "partition/partition.hpp"
#include "support/series.hpp"
#include "tree/forest.hpp"

namespace {

using namespace tfdude;

constexpr std::size_t kFrames = 100'000;
constexpr std::size_t kChildren = 10;  // of each frame
constexpr Time kNow{std::chrono::seconds(1'000'000'000)};

std::size_t heap() {
  const auto info = ::mallinfo2();
  return info.uordblks + info.hblkhd;
}

std::string id_of(std::size_t number) { return "frame_" + std::to_string(100'000 + number); }

std::vector<FrameSpec> frames() {
  std::vector<FrameSpec> all;
  all.reserve(kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    all.push_back({id_of(i), i == 0 ? std::string() : id_of((i - 1) / kChildren), Transform{}});
  }
  return all;
}

/// What a participant knows of frames.
struct Known {
  explicit Known(const std::string& own) : directory(forest, own) {}
  Forest forest;
  Directory directory;
  std::unique_ptr<Partition> partition;
};

/// @param make  makes what is measured, and returns it
void measure(const char* key, const std::function<std::unique_ptr<Known>()>& make) {
  bench::Series bytes(key, "bytes");
  const std::size_t before = heap();
  const auto made = make();
  bytes.add(static_cast<double>(heap() - before) / kFrames);
  bytes.end_repetition();
  bytes.print();
}

}  // namespace

int main() {
  std::vector<Page> pages;
  {
    Known owner("owner");
    Partition partition("owner", 1, owner.forest, owner.directory);
    if (!partition.load(frames(), kNow)) return 1;
    pages = partition.take_pages();
  }
  measure("memory/owner", [] {
    auto owner = std::make_unique<Known>("owner");
    owner->partition = std::make_unique<Partition>("owner", 1, owner->forest, owner->directory);
    if (owner->partition->load(frames(), kNow)) (void)owner->partition->take_pages();
    return owner;
  });
  measure("memory/replica", [&pages] {
    auto replica = std::make_unique<Known>("");
    for (const Page& page : pages) replica->directory.apply(page);
    return replica;
  });
  return 0;
}
