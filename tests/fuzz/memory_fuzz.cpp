// Changes words in the memory of an owner, before or after a reader has bound its edges. Whatever
// it contains, lookups end, stay in the memory, and return what is finite.

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <sys/mman.h>
#include <vector>

#include "fuzz/demand.hpp"
#include "tree/arena.hpp"
#include "tree/forest.hpp"
#include "tree/remote_edges.hpp"

namespace tfdude::fuzz {
namespace {

constexpr int kDepth = 8;
constexpr std::size_t kSize = std::size_t{256} << 10U;
constexpr std::size_t kPage = 4096;

std::string link(int i) { return "link " + std::to_string(i); }
Time at_ms(std::int64_t ms) { return time_of(ms * 1'000'000); }

struct Owner {
  Owner() {
    EdgeTiming noisy;
    noisy.process_noise = Covariance::trusted(Matrix6d(Matrix6d::Identity() * 1e-6));
    Joint joint;
    joint.S[5] = 1;
    (void)forest.add(link(0), "", Transform::exact({}));
    for (int i = 1; i <= kDepth; ++i) {
      (void)forest.add(link(i), link(i - 1), Transform::exact({}));
      if (i % 3 == 0) (void)forest.set_timing(link(i), noisy);
      for (int n = 0; n < 20 && i % 4 != 1; ++n) {
        const JointState state{&joint, {0.1 * n, 1e-4}, i % 8 == 0 ? 6.283185307 : 0};
        const Transform X = joint_transform(joint, state.at.position, state.at.variance);
        const JointState none;
        (void)forest.update_correlated(
            {{*forest.find(link(i)), X, nullptr, i % 2 == 0 ? state : none}},
            at_ms(100 + 10 * n + i));
      }
    }
    const Loading loading = Loading::Constant(6, 3, 1e-3);
    const Correlation said{true, {{"source", false, loading}}, {}};
    const Correlation observed{
        false, {{"observed:1", false, loading}, {"observed:2", true, 0.1 * loading}}, {link(1)}};
    (void)forest.correlate(link(2), said);
    (void)forest.correlate(link(5), said);
    (void)forest.revise({{link(1), Transform::exact({}), observed}}, std::nullopt, UINT64_MAX);
    (void)forest.revise({{link(3), Transform::exact({}), observed}}, at_ms(203), UINT64_MAX);
    (void)forest.revise({{link(6), Transform::exact({}), observed}}, at_ms(210), UINT64_MAX);
  }
  std::unique_ptr<char, void (*)(char*)> memory{
      static_cast<char*>(std::aligned_alloc(kPage, kSize)), [](char* at) { std::free(at); }};
  std::shared_ptr<Arena> arena =
      std::make_shared<Arena>(std::memset(memory.get(), 0, kSize), kSize);
  Forest forest{nullptr, arena};
};

struct Reader {
  Reader() {
    (void)forest.put_remote(link(0), "", 1);
    for (int i = 1; i <= kDepth; ++i) (void)forest.put_remote(link(i), link(i - 1), 1);
    // Between pages that nobody may touch.
    auto* around = static_cast<char*>(
        mmap(nullptr, kSize + 2 * kPage, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    copy = around + kPage;
    (void)mprotect(copy, kSize, PROT_READ | PROT_WRITE);
  }
  Forest forest;
  char* copy = nullptr;
};

void change(char* memory, std::size_t used, const std::uint8_t* data, std::size_t size) {
  struct Word {
    std::uint32_t place;
    std::uint8_t how;
    std::uint8_t unused[3];
    std::uint64_t value;
  };
  std::uint64_t base = 0;
  std::memcpy(&base, memory + 16, sizeof(base));
  for (std::size_t at = 0; at + sizeof(Word) <= size; at += sizeof(Word)) {
    Word word;
    std::memcpy(&word, data + at, sizeof(word));
    char* place = memory + word.place % (used / 8) * 8;
    std::uint64_t value = 0;
    std::memcpy(&value, place, sizeof(value));
    switch (word.how % 4) {
      case 0:
        value = word.value;
        break;
      case 1:
        value ^= std::uint64_t{1} << word.value % 64;
        break;
      case 2:
        value = base + word.value % (used + kPage);
        break;
      default:
        value = base + word.value % (used / 64) * 64;
    }
    std::memcpy(place, &value, sizeof(value));
  }
}

void demand_finite(const Transform& X) {
  demand(check_finite(X).has_value(), "an answer is finite");
}

}  // namespace

void run(const std::uint8_t* data, std::size_t size) {
  static const Owner owner;
  static const Reader reader;
  if (size < 2) return;
  std::memcpy(reader.copy, owner.memory.get(), kSize);
  const std::size_t used = owner.arena->used();
  const bool early = data[0] % 2 == 0;
  const auto opened = RemoteForest::open(reader.copy, kSize);
  demand(opened.has_value(), "intact memory is opened");
  RemoteEdges others;
  others.attach(1, *opened, nullptr);
  if (early) change(reader.copy, used, data + 2, size - 2);
  (void)reader.forest.bind(link(0), link(kDepth), others);
  if (!early) change(reader.copy, used, data + 2, size - 2);
  Query query;
  query.at = at_ms(100 + data[1]);
  query.extrapolate = std::chrono::milliseconds(20);
  if (data[0] % 4 > 1) query.order = Order::kFourth;
  if (const auto X = reader.forest.lookup(link(0), link(kDepth), others)) demand_finite(*X);
  if (const auto X = reader.forest.lookup(link(0), link(kDepth), query, others)) demand_finite(*X);
  const auto segments =
      reader.forest.lookup_segments({{link(0), link(kDepth)}}, query, query.at, others);
  for (std::size_t i = 0; segments && i < segments->values.size(); ++i) {
    demand_finite(segments->values[i]);
  }
  (void)reader.forest.bind(link(0), link(kDepth), others, true);
  if (const auto X = reader.forest.lookup_former(link(0), link(kDepth), others)) demand_finite(*X);
  (void)reader.forest.written(link(0), link(kDepth), others);
  (void)reader.forest.explain({Errc::kTooOld, {}}, link(0), link(kDepth), query, others);
  (void)RemoteForest::open(reader.copy, kSize);
}

}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run(data, size);
  return 0;
}
