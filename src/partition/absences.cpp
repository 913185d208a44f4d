#include "partition/absences.hpp"

#include <algorithm>

namespace tfdude {

void Absences::put(const std::string& partition, std::uint64_t incarnation, Time now,
                   Absent::Kind kind, Absent::Kind then) {
  missed_[partition] = {{partition, now.time_since_epoch().count(), kind, incarnation}, then, {}};
  limit();
}

void Absences::limit() {
  if (missed_.size() <= kMost) return;
  missed_.erase(std::min_element(missed_.begin(), missed_.end(), [](const auto& a, const auto& b) {
    return a.second.absent.since < b.second.absent.since;
  }));
}

void Absences::went(const std::string& partition, std::uint64_t incarnation, bool stopped,
                    Time now) {
  const Absent::Kind then = stopped ? Absent::Kind::kStopped : Absent::Kind::kLost;
  // What is not settled yet of an absence before this one still is not.
  const auto before = missed_.find(partition);
  const bool again = before != missed_.end() && before->second.absent.kind == Absent::Kind::kBack;
  put(partition, incarnation, now, again ? then : Absent::Kind::kSilent, then);
}

void Absences::told(const Absent& absent) {
  if (absent.kind == Absent::Kind::kSilent || absent.kind == Absent::Kind::kBack) return;
  Absent silent = absent;
  silent.kind = Absent::Kind::kSilent;
  if (missed_.emplace(absent.partition, Missed{silent, absent.kind, {}, true}).second) limit();
}

void Absences::resume(const Absent& absent) {
  if (missed_.emplace(absent.partition, Missed{absent, absent.kind, {}}).second) limit();
}

bool Absences::returned(const std::string& partition) {
  const auto there = missed_.find(partition);
  if (there == missed_.end()) return false;
  Absent& absent = there->second.absent;
  if (outlived(absent.kind)) {
    absent.kind = Absent::Kind::kBack;
  } else {
    missed_.erase(there);
  }
  return true;
}

void Absences::settled(const std::string& partition) {
  const auto there = missed_.find(partition);
  if (there != missed_.end() && there->second.absent.kind == Absent::Kind::kBack) {
    missed_.erase(there);
  }
}

void Absences::forget(const std::string& partition, std::uint64_t incarnation, Time now) {
  const auto before = find(partition);
  if (before && before->kind == Absent::Kind::kForgotten && before->incarnation >= incarnation) {
    return;
  }
  put(partition, incarnation, now, Absent::Kind::kForgotten, Absent::Kind::kForgotten);
}

std::vector<std::string> Absences::look(Steady now) {
  // Who has not looked for so long has hung itself: it cannot say who was there meanwhile.
  const bool hung = looked_ && now - *looked_ > kGrace / 2;
  looked_ = now;
  std::vector<std::string> gone;
  for (auto& [name, missed] : missed_) {
    if (missed.absent.kind != Absent::Kind::kSilent) continue;
    if (!missed.noticed || hung) missed.noticed = now;
    if (now - *missed.noticed < kGrace) continue;
    missed.absent.kind = missed.then;
    missed.hearsay = false;
    gone.push_back(name);
  }
  return gone;
}

bool Absences::any_silent() const {
  return std::any_of(missed_.begin(), missed_.end(), [](const auto& known) {
    return known.second.absent.kind == Absent::Kind::kSilent;
  });
}

bool Absences::any_hearsay() const {
  return std::any_of(missed_.begin(), missed_.end(),
                     [](const auto& known) { return known.second.hearsay; });
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
    if (!missed.hearsay) all.push_back(missed.absent);
  }
  return all;
}

}  // namespace tfdude
