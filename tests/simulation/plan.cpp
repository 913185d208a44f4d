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
  constexpr auto kDeputize = static_cast<std::size_t>(FaultKind::kDeputize);  // draw_deputy()
  for (std::size_t kind = 0; kind < kDeputize; ++kind) {
    weights.at(kind) = random.index(3) == 0 ? 0 : 1 + random.index(5);
  }
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

// Either a daemon that is otherwise well hangs while another one is forgotten. Or that one has been
// started once more before, which only some clients have heard, and not the one that forgets it.
void draw_beside(Random& random, Plan& plan) {
  std::vector<std::size_t> well;
  for (std::size_t i = 0; i < plan.owners; ++i) {
    const bool broken =
        std::any_of(plan.lasting.begin(), plan.lasting.end(), [i](const Fault& fault) {
          return fault.target == i || (fault.kind == FaultKind::kPart && fault.other == i);
        });
    if (!broken) well.push_back(i);
  }
  const std::size_t which = random.index(4);
  if (!plan.forgets || plan.lasting.empty() || which == 0) return;
  const auto add = [&](FaultKind kind, std::size_t target, Instant begin, Instant end) {
    Fault fault;
    fault.kind = kind;
    fault.target = target;
    fault.begin = plan.storm + begin;
    fault.end = plan.storm + end;
    plan.beside.push_back(fault);
  };
  if (which == 1 && well.size() > 1) {
    return add(FaultKind::kPause, well[random.index(well.size())],
               between(random, milliseconds(500), milliseconds(4000)),
               between(random, milliseconds(4100), milliseconds(6000)));
  }
  const Fault& out = plan.lasting.front();
  if (plan.storm < milliseconds(5000) || out.kind != FaultKind::kKill) return;
  const Instant heard = between(random, milliseconds(200), milliseconds(1500));
  add(FaultKind::kDeafen, plan.owners, milliseconds(-3600), heard);
  for (const std::size_t one : well) add(FaultKind::kCut, one, milliseconds(-3600), heard);
  add(FaultKind::kKill, out.target, milliseconds(-3500), milliseconds(-3000));
}

// The last owner is down for so long that the first one takes a frame of it over. Nothing else
// happens to these two then: if the last one returns too early, the first one cannot start.
void draw_deputy(Random& random, Plan& plan) {
  const bool deputizes = random.index(3) == 0;
  const bool stops = random.index(2) == 0;
  const bool in_peace = random.index(2) == 0;
  const Instant back = between(random, milliseconds(-1500), milliseconds(0));
  if (!deputizes || plan.storm < milliseconds(9500)) return;
  if (!plan.wild_stores || !plan.beside.empty()) return;
  Fault down;
  down.kind = stops ? FaultKind::kStop : FaultKind::kKill;
  down.target = plan.owners - 1;
  down.begin = plan.storm - milliseconds(8000);
  down.end = plan.storm + back;
  Fault deputy;
  deputy.kind = FaultKind::kDeputize;
  deputy.begin = down.begin + milliseconds(3500);
  deputy.end = deputy.begin + milliseconds(300);
  plan.beside = {down, deputy};
  const auto disturbs = [&](const Fault& fault) {
    const bool last = fault.kind == FaultKind::kRename || fault.kind == FaultKind::kReplace;
    const auto concerns = [&](std::size_t owner) { return owner == 0 || owner == down.target; };
    const bool either =
        concerns(fault.target) || (fault.kind == FaultKind::kPart && concerns(fault.other));
    const bool ends_before = fault.end <= down.begin - milliseconds(1000);
    if (in_peace) return !ends_before || fault.kind == FaultKind::kPowerLoss || last;
    return (last || either) && !ends_before;
  };
  if (in_peace) {
    plan.lasting.clear();
    plan.forgets = false;
  }
  plan.faults.erase(std::remove_if(plan.faults.begin(), plan.faults.end(), disturbs),
                    plan.faults.end());
}

}  // namespace

const char* name_of(FaultKind kind) {
  static constexpr std::array<const char*, kFaultKinds> kNames{
      "kill", "stop",       "power loss", "pause",   "cut",    "mute",        "deafen",
      "part", "step clock", "fill disk",  "replace", "rename", "reconfigure", "deputize"};
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

bool Plan::deputizes_in_peace() const {
  const auto is_left = [](const Fault& fault) { return !fault.left_out; };
  if (beside.empty() || beside.back().kind != FaultKind::kDeputize) return false;
  return std::all_of(beside.begin(), beside.end(), is_left) && lasting.empty() &&
         std::none_of(faults.begin(), faults.end(),
                      [&](const Fault& fault) {
                        return is_left(fault) && fault.end > beside.front().begin;
                      }) &&
         !may_lose_power() && !may_lack_state(owners - 1);
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
  plan.waiters = random.index(2);
  plan.streamers = random.index(2);
  draw_beside(random, plan);
  draw_deputy(random, plan);
  plan.measurers = random.index(4) == 0 ? 1 : 0;
  plan.pacers = random.index(4) == 0 ? 1 : 0;
  return plan;
}

}  // namespace tfdude::simulation
