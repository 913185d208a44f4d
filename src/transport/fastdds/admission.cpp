#include "transport/fastdds/admission.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"

namespace tfdude::fastdds {

std::string Admission::reason_against(const Announcement& said) const {
  if (said.authority == authority_) return {};
  if (authority_.empty()) {
    return "needs keys, and this participant has none (option --keys or TFDUDE_KEYS)";
  }
  if (said.authority.empty()) return "has no keys, and this participant has some";
  return "has keys of another authority (" + quote(said.authority) + ") than this participant (" +
         quote(authority_) + ")";
}

void Admission::discovered(const PeerId& peer, const Announcement& said) {
  const Lock lock(mutex_);
  // Other participants of DDS write streams; whether they may is decided by DDS.
  std::string reason = said.is_ours ? reason_against(said) : std::string();
  if (reason.empty() && (authority_.empty() || verified_.count(peer) != 0)) return met_(peer, said);
  candidates_.insert_or_assign(peer, Candidate{said, std::move(reason)});
  note_awaited();
}

void Admission::authenticated(const PeerId& peer, bool verified) {
  const Lock lock(mutex_);
  const auto known = candidates_.find(peer);
  if (verified) {
    verified_.insert(peer);
    if (known == candidates_.end()) return;
    const Announcement said = known->second.said;
    candidates_.erase(known);
    met_(peer, said);
    note_awaited();  // only now: in between it is neither awaited nor met
  } else if (known != candidates_.end() && known->second.excluded_because.empty()) {
    known->second.excluded_because =
        "and this participant do not accept each other's keys: one of them is expired or revoked";
    note_awaited();
    const std::string& partition = known->second.said.partition;
    log().warn("{} {}", partition.empty() ? "a client" : "partition " + quote(partition),
               known->second.excluded_because);
  }
}

void Admission::left(const PeerId& peer) {
  const Lock lock(mutex_);
  candidates_.erase(peer);
  verified_.erase(peer);
  note_awaited();
}

void Admission::note_awaited() {
  Clock::rep latest = 0;
  for (const auto& [peer, candidate] : candidates_) {
    if (candidate.said.partition.empty() || !candidate.excluded_because.empty()) continue;
    const auto until = candidate.since + kAwaitedFor;
    latest = std::max<Clock::rep>(latest, until.time_since_epoch().count());
  }
  awaited_until_ = latest;
}

std::vector<std::string> Admission::excluded() const {
  std::vector<std::string> sentences;
  const Lock lock(mutex_);
  for (const auto& [peer, candidate] : candidates_) {
    if (candidate.said.partition.empty() || candidate.excluded_because.empty()) continue;
    sentences.push_back("partition " + quote(candidate.said.partition) + " " +
                        candidate.excluded_because);
  }
  return sentences;
}

}  // namespace tfdude::fastdds
