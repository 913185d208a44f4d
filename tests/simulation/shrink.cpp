#include "simulation/shrink.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>
#include <utility>
#include <vector>

#include "simulation/world.hpp"

namespace tfdude::simulation {
namespace {

constexpr const char* kNotDeterministic = "the second run differs";
// How many runs to try. Each takes about 20 ms.
constexpr std::size_t kMostRuns = 4000;

class Shrinker {
 public:
  explicit Shrinker(Remains failing) : best_(std::move(failing)), kind_(failure_of(best_)) {}

  Remains shrink() {
    if (kind_.empty()) return best_;
    std::size_t before = 0;
    do {
      before = size();
      shorten();
      leave_out(operations());
      leave_out(decisions());
    } while (size() < before && runs_ < kMostRuns);
    leave_out_all_that_were_not_made();
    return best_;
  }

 private:
  [[nodiscard]] Plan plan() const { return plan_without(best_.seed, best_.without, best_.storm); }
  [[nodiscard]] std::size_t size() const { return operations().size() + decisions().size(); }

  [[nodiscard]] std::vector<std::size_t> operations() const { return run(plan()).operations; }

  [[nodiscard]] std::vector<std::size_t> decisions() const {
    std::vector<std::size_t> left;
    const std::size_t all = decisions_of(plan()).size();
    for (std::size_t number = 0; number < all; ++number) {
      if (best_.without.count(number) == 0) left.push_back(number);
    }
    return left;
  }

  bool take_if_it_fails(const Remains& less) {
    ++runs_;
    const Plan plan = plan_without(less.seed, less.without, less.storm);
    const Run once = run(plan);
    const bool fails = kind_ == kNotDeterministic
                           ? first_difference(once.steps, run(plan).steps).has_value()
                           : !once.failures.empty() && once.failures.front().kind == kind_;
    if (fails) best_ = less;
    return fails;
  }

  void shorten() {
    constexpr int kHalvings = 5;
    Instant least{0};
    Instant most = plan().storm;
    for (int i = 0; i < kHalvings; ++i) {
      Remains less = best_;
      less.storm = std::chrono::duration_cast<milliseconds>((least + most) / 2);
      (take_if_it_fails(less) ? most : least) = less.storm;
    }
  }

  // All of them, then halves, quarters...
  void leave_out(std::vector<std::size_t> numbers) {
    for (std::size_t size = numbers.size(); size > 0; size /= 2) {
      for (std::size_t at = 0; at < numbers.size() && runs_ < kMostRuns;) {
        const auto first = numbers.begin() + static_cast<std::ptrdiff_t>(at);
        const auto last = first + static_cast<std::ptrdiff_t>(std::min(size, numbers.size() - at));
        Remains less = best_;
        less.without.insert(first, last);
        if (take_if_it_fails(less)) {
          numbers.erase(first, last);
        } else {
          at += size;
        }
      }
    }
  }

  // Changes nothing, but is shorter to write.
  void leave_out_all_that_were_not_made() {
    const auto made = operations();
    Remains same = best_;
    for (std::size_t actor = 0; actor < plan().actors(); ++actor) {
      for (std::size_t i = 0; i < kOperationsEach; ++i) same.without.insert(number_of(actor, i));
    }
    for (const std::size_t number : made) same.without.erase(number);
    (void)take_if_it_fails(same);
  }

  Remains best_;
  const std::string kind_;
  std::size_t runs_ = 0;
};

}  // namespace

std::string failure_of(const Remains& remains) {
  const Plan plan = plan_without(remains.seed, remains.without, remains.storm);
  const Run one = run(plan);
  if (!one.failures.empty()) return one.failures.front().kind;
  return first_difference(one.steps, run(plan).steps) ? kNotDeterministic : "";
}

Remains shrink(const Remains& failing) { return Shrinker(failing).shrink(); }

std::string Remains::options() const {
  std::ostringstream out;
  out << "--seed " << seed;
  if (storm != Instant::max()) {
    out << " --storm " << std::chrono::duration_cast<milliseconds>(storm).count();
  }
  const char* before = " --without ";
  for (auto first = without.begin(); first != without.end();) {
    auto last = first;
    while (std::next(last) != without.end() && *std::next(last) == *last + 1) ++last;
    out << before << *first;
    if (last != first) out << '-' << *last;
    before = ",";
    first = std::next(last);
  }
  return out.str();
}

std::set<std::size_t> numbers_of(const std::string& ranges) {
  std::set<std::size_t> numbers;
  std::istringstream in(ranges);
  for (std::size_t first = 0; in >> first;) {
    std::size_t last = first;
    if (in.peek() == '-') {
      in.ignore();
      in >> last;
    }
    for (; first <= last; ++first) numbers.insert(first);
    if (in.peek() == ',') in.ignore();
  }
  return numbers;
}

}  // namespace tfdude::simulation
