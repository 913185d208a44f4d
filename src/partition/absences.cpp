#include "partition/absences.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

namespace tfdude {

void Absences::put(const std::string& partition, std::uint64_t incarnation, Time now,
                   Absent::Kind kind, Absent::Kind then) {
  const Absent absent{partition, now.time_since_epoch().count(), kind, incarnation};
  missed_[partition] = {absent, then, {}, {}, kind == Absent::Kind::kSilent};
  limit(partition);
}

// Whom this participant has survived must yield to it: if that is forgotten, changes that it has
// acknowledged are lost. One that it has not met yet may contest anything. The longer one of those
// is missed, the more has changed since.
void Absences::limit(const std::string& kept) {
  if (missed_.size() <= kMost) return;
  const auto worth = [&](const auto& entry) {
    const Missed& missed = entry.second;
    const std::int64_t since = missed.absent.since;
    if (entry.first == kept) return std::pair(4, since);
    if (!missed.teller.empty()) return std::pair(0, since);
    if (missed.pending && missed.absent.kind != Absent::Kind::kBack) return std::pair(3, since);
    return contests_(entry.first) ? std::pair(2, ~since) : std::pair(1, since);
  };
  auto least = missed_.begin();
  auto least_worth = worth(*least);
  for (auto one = std::next(least); one != missed_.end(); ++one) {
    const auto its = worth(*one);
    if (its < least_worth) std::tie(least, least_worth) = std::tuple(one, its);
  }
  missed_.erase(least);
}

void Absences::mark_absent(const std::string& partition, std::uint64_t incarnation, bool stopped,
                           Time now, std::chrono::nanoseconds early) {
  const Absent::Kind then = stopped ? Absent::Kind::kStopped : Absent::Kind::kLost;
  // An earlier absence that is not resolved stays unresolved.
  const auto before = missed_.find(partition);
  const bool again = before != missed_.end() && before->second.absent.kind == Absent::Kind::kBack &&
                     !before->second.pending;
  put(partition, incarnation, now, again ? then : Absent::Kind::kSilent, then);
  missed_.at(partition).early = early;
}

void Absences::add_report(const Absent& absent, const std::string& teller) {
  if (absent.kind == Absent::Kind::kBack) return;
  Absent silent = absent;
  silent.kind = Absent::Kind::kSilent;
  Missed hearsay{silent, absent.kind, {}, teller, true};
  const auto [there, is_new] = missed_.emplace(absent.partition, std::move(hearsay));
  if (!is_new && there->second.then == Absent::Kind::kSilent) there->second.then = absent.kind;
  if (is_new) limit({});
}

void Absences::replace_reports(const std::vector<Absent>& absent, const std::string& teller) {
  for (auto it = missed_.begin(); it != missed_.end();) {
    const std::string& name = it->first;
    const Missed& missed = it->second;
    const bool retracted = missed.teller == teller && missed.then == Absent::Kind::kSilent &&
                           std::none_of(absent.begin(), absent.end(),
                                        [&](const Absent& one) { return one.partition == name; });
    it = retracted ? missed_.erase(it) : std::next(it);
  }
}

void Absences::teller_restarted(const std::string& teller) {
  for (auto& [name, missed] : missed_) {
    const bool open = missed.teller == teller && missed.then == Absent::Kind::kSilent;
    if (open) missed.then = Absent::Kind::kLost;
  }
}

void Absences::teller_gone(const std::string& teller) {
  for (auto& [name, missed] : missed_) {
    const bool open = missed.teller == teller && missed.then == Absent::Kind::kSilent;
    if (open && missed.relied_on) missed.then = Absent::Kind::kLost;
  }
  replace_reports({}, teller);
}

void Absences::relied_on(const std::string& partition) {
  const auto there = missed_.find(partition);
  if (there != missed_.end()) there->second.relied_on = true;
}

void Absences::heard_of(const std::string& partition, std::uint64_t incarnation) {
  const auto there = missed_.find(partition);
  if (there == missed_.end() || there->second.absent.kind == Absent::Kind::kForgotten) return;
  std::uint64_t& latest = there->second.absent.incarnation;
  latest = std::max(latest, incarnation);
}

void Absences::resume(const Absent& absent) {
  if (missed_.emplace(absent.partition, Missed{absent, absent.kind, {}}).second) limit({});
}

bool Absences::returned(const std::string& partition) {
  const auto there = missed_.find(partition);
  if (there == missed_.end()) return false;
  Missed& missed = there->second;
  if (missed.absent.kind == Absent::Kind::kBack) return true;
  if (survived(missed.absent.kind)) {
    missed.absent.kind = Absent::Kind::kBack;
    missed.pending = false;
  } else {
    missed_.erase(there);
  }
  return true;
}

void Absences::set_resolved(const std::string& partition, bool resolved) {
  const auto there = missed_.find(partition);
  if (there == missed_.end() || there->second.absent.kind != Absent::Kind::kBack) return;
  Missed& missed = there->second;
  if (std::exchange(missed.pending, resolved) != resolved) missed.noticed.reset();
}

void Absences::forget(const std::string& partition, std::uint64_t incarnation, Time now) {
  const auto before = find(partition);
  if (before && before->kind == Absent::Kind::kForgotten && before->incarnation >= incarnation) {
    return;
  }
  put(partition, incarnation, now, Absent::Kind::kForgotten, Absent::Kind::kForgotten);
}

bool Absences::advance(Missed& missed, Steady now, bool hung, Looked& looked) {
  const bool silent = missed.absent.kind == Absent::Kind::kSilent;
  const bool back = missed.absent.kind == Absent::Kind::kBack;
  if (!missed.noticed) missed.noticed = now;
  if (hung) missed.noticed = silent || back ? now : std::max(*missed.noticed, now - kGrace);
  const auto passed = now - *missed.noticed;
  if (back) {
    missed.pending = passed < kGrace;
    looked.counts = looked.counts || !missed.pending;
    return !missed.pending;
  }
  if (silent && missed.then != Absent::Kind::kSilent && passed >= kGrace) {
    missed.absent.kind = missed.then;
    missed.teller.clear();
    looked.counts = true;
  }
  missed.pending = missed.absent.kind == Absent::Kind::kSilent || passed < kTakeover + missed.early;
  return !missed.pending;
}

Absences::Looked Absences::look(Steady now) {
  // A process that has not called this for so long has hung: it cannot tell who was reachable
  // meanwhile.
  const bool hung = looked_ && now - *looked_ > kGrace / 2;
  looked_ = now;
  Looked looked;
  for (auto one = missed_.begin(); one != missed_.end();) {
    const auto& [name, missed] = *one;
    const bool ends = missed.pending && advance(one->second, now, hung, looked);
    if (ends && missed.absent.kind == Absent::Kind::kBack) {
      one = missed_.erase(one);
      continue;
    }
    if (ends) looked.gone.push_back(name);
    ++one;
  }
  return looked;
}

bool Absences::any_pending() const {
  return std::any_of(missed_.begin(), missed_.end(),
                     [](const auto& known) { return known.second.pending; });
}

bool Absences::any_hearsay() const {
  return std::any_of(missed_.begin(), missed_.end(),
                     [](const auto& known) { return !known.second.teller.empty(); });
}

std::vector<std::string> Absences::back() const {
  std::vector<std::string> names;
  for (const auto& [name, missed] : missed_) {
    if (missed.absent.kind == Absent::Kind::kBack) names.push_back(name);
  }
  return names;
}

std::optional<Absent> Absences::find(const std::string& partition) const {
  const auto there = missed_.find(partition);
  if (there == missed_.end()) return std::nullopt;
  return there->second.absent;
}

std::vector<Absent> Absences::all() const {
  std::vector<Absent> all;
  for (const auto& [name, missed] : missed_) {
    if (missed.teller.empty()) all.push_back(missed.absent);
  }
  return all;
}

}  // namespace tfdude
