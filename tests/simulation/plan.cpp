#include "simulation/plan.hpp"

#include <algorithm>
#include <array>
#include <sstream>

namespace tfdude::simulation {
namespace {

using testing::Random;

Instant between(Random& random, milliseconds least, milliseconds most) {
  return std::chrono::duration_cast<Instant>(std::chrono::duration<double>(random.uniform(
      std::chrono::duration<double>(least).count(), std::chrono::duration<double>(most).count())));
}

// Too short to be noticed, long enough to be noticed, or so long that others react.
Instant length(Random& random) {
  switch (random.index(3)) {
    case 0:
      return between(random, milliseconds(20), milliseconds(450));
    case 1:
      return between(random, milliseconds(450), milliseconds(1200));
    default:
      return between(random, milliseconds(1200), milliseconds(5000));
  }
}

// The possible faults, with their weights; some do not occur in this run.
std::array<std::size_t, kFaultKinds> draw_weights(Random& random, bool stores) {
  std::array<std::size_t, kFaultKinds> weights{};
  for (std::size_t& weight : weights) weight = random.index(3) == 0 ? 0 : 1 + random.index(5);
  weights[0] += 1;
  if (!stores) weights[static_cast<std::size_t>(FaultKind::kFillDisk)] = 0;
  return weights;
}

FaultKind draw_kind(Random& random, const std::array<std::size_t, kFaultKinds>& weights) {
  std::size_t all = 0;
  for (const std::size_t weight : weights) all += weight;
  std::size_t draw = random.index(all);
  std::size_t kind = 0;
  while (draw >= weights[kind]) draw -= weights[kind++];
  return static_cast<FaultKind>(kind);
}

}  // namespace

const char* name_of(FaultKind kind) {
  static constexpr std::array<const char*, kFaultKinds> kNames{
      "kill",       "stop",      "pause",   "cut",    "cut one way", "part",
      "step clock", "fill disk", "replace", "rename", "reconfigure"};
  return kNames.at(static_cast<std::size_t>(kind));
}

Plan draw_plan(std::uint64_t seed) {
  Random random(seed);
  Plan plan;
  plan.seed = seed;
  // Small ones fail as large ones do, and are faster.
  plan.owners = random.index(20) == 0 ? 5 + random.index(20) : 2 + random.index(3);
  plan.clients = random.index(20) == 0 ? 1 + random.index(5) : 1 + random.index(2);
  plan.storm = between(random, milliseconds(3000), milliseconds(12000));
  plan.loss = random.index(3) == 0 ? 0 : random.uniform(0, 0.3);
  plan.repeats = random.index(2) == 0 ? 0 : random.uniform(0, 0.2);
  plan.delay = random.index(4) == 0 ? between(random, milliseconds(2), milliseconds(40))
                                    : std::chrono::microseconds(200);
  plan.disk =
      random.index(4) == 0 ? between(random, milliseconds(5), milliseconds(200)) : milliseconds(1);
  plan.contest = random.index(3) == 0 ? 0 : random.uniform(0, 0.5);
  plan.stores = random.index(8) != 0;
  plan.wild_stores = plan.stores && random.index(2) == 0;
  const auto weights = draw_weights(random, plan.stores);
  plan.lost = plan.owners > 2 && random.index(4) == 0 ? random.index(plan.owners) : plan.owners;
  plan.loss_after = random.index(2) == 0 ? 0 : random.uniform(0, 0.02);
  const double harshness = random.uniform(0.2, 1.5);  // faults per second
  for (Instant at = milliseconds(1500); at < plan.storm;
       at += between(random, milliseconds(0), milliseconds(static_cast<int>(2000 / harshness)))) {
    Fault fault;
    fault.kind = draw_kind(random, weights);
    fault.begin = at;
    fault.end = std::min(at + length(random), plan.storm);
    fault.target = random.index(plan.owners);
    fault.other = (fault.target + 1 + random.index(plan.owners - 1)) % plan.owners;
    const auto reach = random.index(2) == 0 ? 7'200'000 : 3'000;
    fault.step = milliseconds(static_cast<int>(random.uniform(-reach, reach)));
    plan.faults.push_back(fault);
  }
  plan.followers = random.index(2);
  return plan;
}

Plan shrink(Plan plan, const std::function<bool(const Plan&)>& fails) {
  const auto try_it = [&](Plan milder) {
    if (!fails(milder)) return false;
    plan = std::move(milder);
    return true;
  };
  for (std::size_t i = plan.faults.size(); i-- > 0;) {
    Plan less = plan;
    less.faults.erase(less.faults.begin() + static_cast<std::ptrdiff_t>(i));
    (void)try_it(std::move(less));
  }
  const std::vector<std::function<void(Plan&)>> milder{
      [](Plan& one) { one.loss = one.loss_after = 0; },
      [](Plan& one) { one.repeats = 0; },
      [](Plan& one) { one.delay = std::chrono::microseconds(200); },
      [](Plan& one) { one.disk = milliseconds(1); },
      [](Plan& one) { one.contest = 0; },
      [](Plan& one) { one.clients = 1; },
      [](Plan& one) { one.followers = 0; },
      [](Plan& one) { one.lost = one.owners; }};
  for (const auto& change : milder) {
    Plan one = plan;
    change(one);
    (void)try_it(std::move(one));
  }
  return plan;
}

std::string Plan::text() const {
  std::ostringstream out;
  const auto ms = [](Instant instant) {
    return std::chrono::duration<double, std::milli>(instant).count();
  };
  out << "seed " << seed << ": " << owners << " owners, " << clients << " clients, " << followers
      << " followers, storm " << ms(storm) << " ms, loss " << loss << ", repeats " << repeats
      << ", delay " << ms(delay) << " ms, disk " << ms(disk) << " ms, contest " << contest
      << (stores ? ", stored" : ", not stored") << (wild_stores ? "" : " (the last is not)");
  if (lost < owners) out << ", owner " << lost << " lost for good";
  for (std::size_t i = 0; i < faults.size(); ++i) {
    const Fault& fault = faults[i];
    out << "\n  fault " << i << ": " << ms(fault.begin) << " to " << ms(fault.end)
        << " ms: " << name_of(fault.kind) << " " << fault.target;
    if (fault.kind == FaultKind::kPart) out << " and " << fault.other;
    if (fault.kind == FaultKind::kStepClock) out << " by " << fault.step.count() << " ms";
  }
  return out.str();
}

}  // namespace tfdude::simulation
