#include "partition/succession.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "partition/frame_claims.hpp"

namespace tfdude {
namespace {

using List = std::vector<const FrameClaim*>;

// Those that meet the condition; if none does, all.
template <class Condition>
List preferred(const List& claims, Condition condition) {
  List some;
  std::copy_if(claims.begin(), claims.end(), std::back_inserter(some), condition);
  return some.empty() ? claims : some;
}

}  // namespace

Owner Succession::add_owner(std::string name) {
  owners_.push_back({std::move(name), Standing::kThere, {}});
  return static_cast<Owner>(owners_.size() - 1);
}

bool Succession::set_standing(Owner owner, Standing standing) {
  return std::exchange(owners_[owner].standing, standing) != standing;
}

bool Succession::set_survived(Owner owner, std::set<Owner> survived) {
  if (owners_[owner].survived == survived) return false;
  owners_[owner].survived = std::move(survived);
  return true;
}

bool Succession::reported_survivor(Owner first, Owner second) const {
  return owners_[first].survived.count(second) != 0 && owners_[second].survived.count(first) == 0;
}

bool Succession::survived(Owner first, Owner second) const {
  return is_gone(first) == is_gone(second) ? reported_survivor(first, second) : is_gone(second);
}

bool Succession::older(const FrameClaim& a, const FrameClaim& b) const {
  return std::tie(a.lamport_time, name(a.owner)) < std::tie(b.lamport_time, name(b.owner));
}

const FrameClaim& Succession::winning_claim(const std::vector<const FrameClaim*>& claims) const {
  const List there =
      preferred(claims, [this](const FrameClaim* one) { return !is_gone(one->owner); });
  const List left = preferred(there, [&](const FrameClaim* one) {
    return std::none_of(there.begin(), there.end(), [&](const FrameClaim* other) {
      return reported_survivor(other->owner, one->owner);
    });
  });
  return **std::min_element(
      left.begin(), left.end(),
      [this](const FrameClaim* a, const FrameClaim* b) { return older(*a, *b); });
}

}  // namespace tfdude
