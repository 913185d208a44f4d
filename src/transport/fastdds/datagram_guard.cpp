#include "transport/fastdds/datagram_guard.hpp"

#include <algorithm>
#include <utility>

#include "base/log.hpp"
#include "transport/fastdds/rtps_layout.hpp"

namespace tfdude::fastdds {
namespace {

using Clock = DatagramGuard::Clock;

class Received final : public NumberClaims {
 public:
  Received(NumberBounds& bounds, Crowd& crowd, Clock::time_point now)
      : bounds_(bounds), crowd_(crowd), now_(now) {}
  bool admit_participant(const NumberClaim::Prefix& participant) override {
    return crowd_.admit(participant, now_);
  }
  bool admit(const NumberClaim& claim) override {
    fragments_ = fragments_ || claim.kind == NumberClaim::Kind::kFragments;
    return bounds_.admit(claim, now_);
  }
  [[nodiscard]] bool fragments() const { return fragments_; }

 private:
  NumberBounds& bounds_;
  Crowd& crowd_;
  const Clock::time_point now_;
  bool fragments_ = false;
};

class Sent final : public NumberClaims {
 public:
  explicit Sent(NumberBounds& bounds) : bounds_(bounds) {}
  bool admit(const NumberClaim& claim) override {
    bounds_.send(claim);
    return true;
  }

  bool admit_participant(const NumberClaim::Prefix&) override { return true; }

 private:
  NumberBounds& bounds_;
};

}  // namespace

DatagramFlaw DatagramGuard::check(const std::uint8_t* datagram, std::size_t size,
                                  Clock::time_point now, bool& fragments) {
  Received claims(bounds_, crowd_, now);
  const DatagramFlaw flaw = check_datagram(datagram, size, secured_, claims);
  fragments = claims.fragments();
  if (!secured_ || (flaw != DatagramFlaw::kNone && flaw != DatagramFlaw::kFarewell)) return flaw;
  PeerId sender{};
  std::copy_n(datagram + rtps::kPrefixAt, sender.size(), sender.begin());
  if (flaw == DatagramFlaw::kFarewell) {
    departures_.said(sender, now);
  } else {
    departures_.heard(sender, now);
  }
  return flaw;
}

std::vector<std::vector<Reassembly::Datagram>> DatagramGuard::reassemble(
    const std::uint8_t* datagram, std::size_t size, Clock::time_point now) {
  class Taker final : public FragmentTaker {
   public:
    Taker(Reassembly& kept, Clock::time_point at) : kept_(kept), now_(at) {}
    void take(const NumberClaim& claim, Reassembly::Datagram one) override {
      auto whole = kept_.take(claim, std::move(one), now_);
      if (!whole.empty()) all.push_back(std::move(whole));
    }
    std::vector<std::vector<Reassembly::Datagram>> all;

   private:
    Reassembly& kept_;
    const Clock::time_point now_;
  } taker(fragments_, now);
  auto rest = take_fragments(datagram, size, taker);
  // Behind, as a heartbeat among it asks for what was not received.
  if (!rest.empty()) taker.all.push_back({std::move(rest)});
  return std::move(taker.all);
}

void DatagramGuard::send(const std::uint8_t* datagram, std::size_t size) {
  if (!sees_sent_) return;
  Sent claims(bounds_);
  for_each_heartbeat(datagram, size, claims);
}

bool DatagramGuard::count(DatagramFlaw flaw, Clock::time_point now) {
  Kind& kind = kinds_[static_cast<std::size_t>(flaw)];
  kind.count.fetch_add(1, std::memory_order_relaxed);
  const Clock::rep time = now.time_since_epoch().count();
  Clock::rep before = kind.logged.load(std::memory_order_relaxed);
  if (before != 0 && time - before < Clock::duration(kLogEvery).count()) return false;
  return kind.logged.compare_exchange_strong(before, time);
}

void DatagramGuard::log(DatagramFlaw flaw, const std::string& from) const {
  const auto& kind = kinds_[static_cast<std::size_t>(flaw)];
  tfdude::log().warn("dropped a datagram from {}: {} ({} so far)", from, to_string(flaw),
                     kind.count.load(std::memory_order_relaxed));
}

std::uint64_t DatagramGuard::refused() const {
  std::uint64_t sum = 0;
  for (const Kind& kind : kinds_) sum += kind.count.load(std::memory_order_relaxed);
  return sum;
}

}  // namespace tfdude::fastdds
