#include "simulation/plan.hpp"

#include <algorithm>

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

using FaultWeights = std::array<std::size_t, kFaultKinds>;

// The possible faults, with their weights; some do not occur in this run.
FaultWeights draw_fault_weights(Random& random, bool stores) {
  FaultWeights weights{};
  for (std::size_t& weight : weights) weight = random.index(3) == 0 ? 0 : 1 + random.index(5);
  weights[0] += 1;
  if (!stores) weights[static_cast<std::size_t>(FaultKind::kFillDisk)] = 0;
  return weights;
}

FaultKind draw_kind(Random& random, const FaultWeights& weights) {
  std::size_t all = 0;
  for (const std::size_t weight : weights) all += weight;
  std::size_t draw = random.index(all);
  std::size_t kind = 0;
  while (draw >= weights[kind]) draw -= weights[kind++];
  return static_cast<FaultKind>(kind);
}

// The usual shares, changed at random; some kinds do not occur. Without frames there is nothing to
// do.
void draw_operations(Random& random, Plan& plan) {
  constexpr std::array<double, kOperationKinds> kUsual{30, 25, 20, 17, 8, 10, 3};
  for (std::size_t kind = 0; kind < kOperationKinds; ++kind) {
    const double share = kUsual.at(kind) * random.uniform(0.2, 2);
    plan.weights.at(kind) = random.index(5) == 0 ? 0 : share;
  }
  double& adds = plan.weights.at(static_cast<std::size_t>(OperationKind::kAdd));
  adds = std::max(adds, 5.0);
}

void draw_clocks(Random& random, Plan& plan) {
  switch (random.index(4)) {
    case 0:
      break;
    case 1:
      plan.offset = between(random, milliseconds(0), std::chrono::minutes(60));
      break;
    default:
      plan.offset = between(random, milliseconds(0), milliseconds(100));
  }
  plan.drift = random.index(3) == 0 ? 0 : random.index(2) == 0 ? 1e-4 : random.uniform(0, 0.05);
}

void draw_faults(Random& random, Plan& plan) {
  const auto weights = draw_fault_weights(random, plan.stores);
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
    if (fault.kind == FaultKind::kStepClock && random.index(3) == 0) {
      fault.target = plan.owners + random.index(plan.clients);
    }
    plan.faults.push_back(fault);
  }
}

// What stays broken. One daemon is left out of it, so that some can agree.
void draw_lasting(Random& random, Plan& plan) {
  if (plan.owners < 3 || random.index(3) != 0) return;
  std::vector<std::size_t> targets(plan.owners);
  for (std::size_t i = 0; i < plan.owners; ++i) targets[i] = i;
  std::shuffle(targets.begin(), targets.end(), random.engine());
  targets.resize(1 + random.index(plan.owners - 1));
  targets.resize(std::min<std::size_t>(targets.size(), 3));
  plan.forgets = random.index(2) == 0;
  while (!targets.empty()) {
    constexpr std::array kKinds{FaultKind::kKill, FaultKind::kPause,    FaultKind::kCut,
                                FaultKind::kMute, FaultKind::kFillDisk, FaultKind::kPart};
    Fault fault;
    fault.kind = kKinds.at(random.index(kKinds.size()));
    fault.begin = plan.storm;
    fault.end = Instant::max();
    fault.target = targets.back();
    targets.pop_back();
    if (fault.kind == FaultKind::kFillDisk && !plan.stores_of(fault.target)) continue;
    if (fault.kind == FaultKind::kPart) {
      if (targets.empty()) break;
      fault.other = targets.back();
      targets.pop_back();
    }
    plan.lasting.push_back(fault);
  }
}

}  // namespace

const char* name_of(FaultKind kind) {
  static constexpr std::array<const char*, kFaultKinds> kNames{
      "kill", "stop",       "power loss", "pause",   "cut",    "mute",       "deafen",
      "part", "step clock", "fill disk",  "replace", "rename", "reconfigure"};
  return kNames.at(static_cast<std::size_t>(kind));
}

const char* name_of(OperationKind kind) {
  static constexpr std::array<const char*, kOperationKinds> kNames{
      "lookup", "update", "add", "move", "remove", "joint", "forget"};
  return kNames.at(static_cast<std::size_t>(kind));
}

std::uint64_t Plan::seed_of(std::size_t actor, std::size_t operation) const {
  return (seed * 31 + actor) * 1'000'003 + operation;
}

bool Plan::leaves_out(std::size_t actor, std::size_t operation) const {
  return operation < kOperationsEach && left_out.count(number_of(actor, operation)) > 0;
}

bool Plan::may_lose_power() const {
  return stores && !sync && std::any_of(faults.begin(), faults.end(), [](const Fault& fault) {
           return fault.kind == FaultKind::kPowerLoss && !fault.left_out;
         });
}

// One that replaces another has no state, and the other one continues with an older number.
bool Plan::may_lack_state(std::size_t owner) const {
  if (!stores_of(owner)) return true;
  return owner + 1 == owners && std::any_of(faults.begin(), faults.end(), [](const Fault& fault) {
           return fault.kind == FaultKind::kReplace && !fault.left_out;
         });
}

Plan draw_plan(std::uint64_t seed) {
  Random random(seed);
  Plan plan;
  plan.seed = seed;
  // Small ones fail as large ones do, and are faster.
  plan.owners = random.index(20) == 0 ? 5 + random.index(20) : 2 + random.index(3);
  plan.clients = random.index(20) == 0 ? 1 + random.index(5) : 1 + random.index(2);
  plan.followers = random.index(2) == 0 ? 0 : 1 + random.index(3);
  plan.storm = between(random, milliseconds(3000), milliseconds(12000));
  plan.loss = random.index(3) == 0 ? 0 : random.uniform(0, 0.3);
  plan.repeats = random.index(2) == 0 ? 0 : random.uniform(0, 0.2);
  plan.delay = random.index(4) == 0 ? between(random, milliseconds(2), milliseconds(40))
                                    : std::chrono::microseconds(200);
  plan.disk =
      random.index(4) == 0 ? between(random, milliseconds(5), milliseconds(200)) : milliseconds(1);
  plan.sync = random.index(3) == 0;
  plan.contest = random.index(3) == 0 ? 0 : random.uniform(0, 0.5);
  plan.stores = random.index(8) != 0;
  plan.wild_stores = plan.stores && random.index(2) == 0;
  plan.loss_after = random.index(2) == 0 ? 0 : random.uniform(0, 0.02);
  draw_clocks(random, plan);
  draw_operations(random, plan);
  draw_faults(random, plan);
  draw_lasting(random, plan);
  plan.samplers = random.index(2);
  return plan;
}

}  // namespace tfdude::simulation
