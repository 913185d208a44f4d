#include <algorithm>
#include <sstream>

#include "simulation/plan.hpp"

// What a seed has decided, and how to leave some of it out.
namespace tfdude::simulation {
namespace {

std::string in_ms(Instant instant) {
  std::ostringstream out;
  out << std::chrono::duration<double, std::milli>(instant).count() << " ms";
  return out.str();
}

std::string text_of(const Fault& fault) {
  std::string text = name_of(fault.kind) + (" " + std::to_string(fault.target));
  if (fault.kind == FaultKind::kPart) text += " and " + std::to_string(fault.other);
  if (fault.kind == FaultKind::kStepClock) {
    text += " by " + std::to_string(fault.step.count()) + " ms";
  }
  if (fault.end == Instant::max()) return text + ", for good";
  return in_ms(fault.begin) + " to " + in_ms(fault.end) + ": " + text;
}

template <class Number>
std::string with(const char* what, Number number) {
  std::ostringstream out;
  out << what << ' ' << number;
  return out.str();
}

std::vector<Decision> faults_of(const Plan& plan) {
  std::vector<Decision> all;
  for (std::size_t i = 0; i < plan.faults.size(); ++i) {
    all.push_back({text_of(plan.faults[i]), [i](Plan& one) { one.faults[i].left_out = true; }});
  }
  for (std::size_t i = 0; i < plan.lasting.size(); ++i) {
    all.push_back({text_of(plan.lasting[i]), [i](Plan& one) { one.lasting[i].left_out = true; }});
  }
  for (std::size_t i = 0; i < plan.beside.size(); ++i) {
    all.push_back({text_of(plan.beside[i]), [i](Plan& one) { one.beside[i].left_out = true; }});
  }
  return all;
}

}  // namespace

std::vector<Decision> decisions_of(const Plan& plan) {
  std::vector<Decision> all = faults_of(plan);
  all.push_back({with("loss", plan.loss), [](Plan& one) { one.loss = 0; }});
  all.push_back({with("loss afterwards", plan.loss_after), [](Plan& one) { one.loss_after = 0; }});
  all.push_back({with("repeats", plan.repeats), [](Plan& one) { one.repeats = 0; }});
  all.push_back({"delay " + in_ms(plan.delay),
                 [](Plan& one) { one.delay = std::chrono::microseconds(200); }});
  all.push_back(
      {"disk " + in_ms(plan.disk), [](Plan& one) { one.disk = std::chrono::milliseconds(1); }});
  all.push_back({"clocks wrong by " + in_ms(plan.offset), [](Plan& one) { one.offset = {}; }});
  all.push_back({with("clocks drift by", plan.drift), [](Plan& one) { one.drift = 0; }});
  all.push_back({with("contest", plan.contest), [](Plan& one) { one.contest = 0; }});
  all.push_back(
      {with("clients, all but the first of", plan.clients), [](Plan& one) { one.clients = 1; }});
  all.push_back({with("followers", plan.followers), [](Plan& one) { one.followers = 0; }});
  all.push_back({with("samplers", plan.samplers), [](Plan& one) { one.samplers = 0; }});
  all.push_back({with("waiters", plan.waiters), [](Plan& one) { one.waiters = 0; }});
  all.push_back({with("measurers", plan.measurers), [](Plan& one) { one.measurers = 0; }});
  all.push_back({with("pacers", plan.pacers), [](Plan& one) { one.pacers = 0; }});
  all.push_back({with("streamers", plan.streamers), [](Plan& one) { one.streamers = 0; }});
  all.push_back(
      {with("forgets who is lost:", plan.forgets), [](Plan& one) { one.forgets = false; }});
  for (std::size_t i = 0; i < kOperationKinds; ++i) {
    all.push_back({with(name_of(static_cast<OperationKind>(i)), plan.weights.at(i)),
                   [i](Plan& one) { one.weights.at(i) = 0; }});
  }
  return all;
}

Plan plan_without(std::uint64_t seed, const std::set<std::size_t>& numbers, Instant storm) {
  Plan plan = draw_plan(seed);
  const auto decisions = decisions_of(plan);
  for (const std::size_t number : numbers) {
    if (number < decisions.size()) decisions[number].leave_out(plan);
  }
  plan.left_out = numbers;
  const Instant before = plan.storm;
  plan.storm = std::min(plan.storm, storm);
  for (Fault& fault : plan.faults) {
    fault.left_out = fault.left_out || fault.begin >= plan.storm;
    fault.end = std::min(fault.end, plan.storm);
  }
  for (Fault& fault : plan.lasting) fault.begin = plan.storm;
  for (Fault& fault : plan.beside) {
    fault.begin -= before - plan.storm;
    fault.end -= before - plan.storm;
    fault.left_out = fault.left_out || fault.begin < Instant(0);
  }
  return plan;
}

std::string Plan::text() const {
  std::ostringstream out;
  out << "seed " << seed << ": " << owners << " owners, faults for " << in_ms(storm)
      << (stores ? ", stored" : ", not stored") << (wild_stores ? "" : " (the last is not)")
      << (sync ? ", synced" : "");
  const auto decisions = decisions_of(draw_plan(seed));
  for (std::size_t i = 0; i < decisions.size(); ++i) {
    if (left_out.count(i) == 0) out << "\n  " << i << ": " << decisions[i].text;
  }
  return out.str();
}

}  // namespace tfdude::simulation
