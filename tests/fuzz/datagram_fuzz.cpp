// Passes any datagrams to the check before Fast DDS, one after the other. A model of the reader and
// the writer of Fast DDS 2.9 takes what was admitted: its work and its memory must stay bounded.

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "fuzz/demand.hpp"
#include "transport/fastdds/number_bounds.hpp"
#include "transport/fastdds/reassembly.hpp"
#include "transport/fastdds/rtps_check.hpp"

namespace tfdude::fuzz {
namespace {

using fastdds::NumberBounds;
using fastdds::NumberClaim;
using Kind = NumberClaim::Kind;

// WriterProxy of Fast DDS 2.9, as one of our readers keeps it for a writer.
class Proxy {
 public:
  // @return how many numbers it has walked through
  std::uint64_t take(const NumberClaim& claim) {
    std::uint64_t steps = 0;
    if (claim.kind == Kind::kHeartbeat && claim.count > count_) {
      count_ = claim.count;
      low_ = std::max(low_, claim.first - 1);
      early_.erase(early_.begin(), early_.lower_bound(claim.first));
    }
    if (claim.kind == Kind::kGap) {
      for (std::uint64_t number = claim.first; number <= claim.last; ++number, ++steps) {
        if (number > low_) early_.insert(number);
      }
    }
    if (claim.kind == Kind::kData && claim.first > low_) early_.insert(claim.first);
    while (!early_.empty() && *early_.begin() == low_ + 1) {
      ++low_;
      early_.erase(early_.begin());
    }
    return steps + low_ - std::exchange(notified_, std::max(notified_, low_));
  }
  [[nodiscard]] std::size_t early() const { return early_.size(); }

 private:
  std::uint64_t low_ = 0;
  std::uint64_t notified_ = 0;
  std::uint32_t count_ = 0;
  std::set<std::uint64_t> early_;
};

class Model final : public fastdds::NumberClaims, public fastdds::FragmentTaker {
 public:
  bool admit(const NumberClaim& claim) override {
    // What a participant can have walked through at once, of a writer that it meets late.
    constexpr std::uint64_t kMostSteps = 1U << 25U;
    demand(claim.kind == Kind::kAcknowledgement || claim.last + 1 >= claim.first, "a range");
    if (!bounds_.admit(claim, now_)) return false;
    fragments = fragments || claim.kind == Kind::kFragments;
    if (claim.kind == Kind::kAcknowledgement) return true;
    const bool user = (claim.writer[3] & 0xC0U) == 0;
    if (user && claim.last > kMostSteps) return true;  // more than a model has time for
    Proxy& proxy = proxies_[{claim.sender, claim.writer}];
    demand(proxy.take(claim) <= kMostSteps, "few numbers are walked through");
    demand(proxy.early() <= 3 * fastdds::kLongestRange, "few numbers are kept");
    return true;
  }
  bool admit_participant(const NumberClaim::Prefix&) override { return true; }
  void begin() {
    now_ += std::chrono::milliseconds(1);
    fragments = false;
  }
  void take(const NumberClaim& claim, std::vector<std::uint8_t> datagram) override {
    sent_ += datagram.size();
    for (const auto& one : reassembly_.take(claim, std::move(datagram), now_)) {
      sent_ -= one.size();
    }
    demand(reassembly_.bytes() <= sent_ + kRows, "little is kept");
  }
  bool fragments = false;  // in the datagram at hand

 private:
  // A bit for each fragment of a sample.
  static constexpr std::size_t kRows =
      fastdds::Reassembly::kMost * (fastdds::kLargestSample / fastdds::kSmallestFragment / 8 + 256);
  NumberBounds bounds_;
  fastdds::Reassembly reassembly_;
  std::size_t sent_ = 0;
  NumberBounds::Clock::time_point now_{std::chrono::hours(1)};
  std::map<std::pair<NumberClaim::Prefix, NumberClaim::Entity>, Proxy> proxies_;
};

void run(const std::uint8_t* data, std::size_t size) {
  Model model;
  const bool secured = size > 0 && (data[0] & 1U) != 0;
  for (std::size_t at = 1; at + 2 < size;) {
    const std::size_t length = std::min<std::size_t>(data[at] | data[at + 1] << 8U, size - at - 2);
    // A copy of its own, so that AddressSanitizer sees its end.
    const std::vector<std::uint8_t> datagram(data + at + 2, data + at + 2 + length);
    model.begin();
    const auto flaw = fastdds::check_datagram(datagram.data(), datagram.size(), secured, model);
    demand(*fastdds::to_string(flaw) != '\0' || flaw == fastdds::DatagramFlaw::kNone, "a reason");
    if (flaw == fastdds::DatagramFlaw::kNone && model.fragments) {
      demand(fastdds::take_fragments(datagram.data(), datagram.size(), model).size() <=
                 datagram.size(),
             "what is left is a part");
    }
    at += 2 + length;
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run(data, size);
  return 0;
}
