#include "tree/no_data.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>

#include "tfdude/base/id.hpp"

#include "base/saturating.hpp"
#include "tree/held_edge.hpp"
#include "tree/held_edges.hpp"

namespace tfdude {
namespace {

// A dynamic edge, with the stamps of its samples.
struct DatedEdge {
  std::string_view id;
  std::int64_t oldest = 0;
  std::int64_t newest = 0;
  std::int64_t reach = 0;  // how far it can be extrapolated
  bool unsampled = false;
  bool lacks_sample = false;

  [[nodiscard]] std::string name() const { return "the edge of " + quote(id); }
};

template <class Edge>
DatedEdge dated(std::string_view id, const Edge& from) {
  const HeldVersion& edge = *from.version;
  const auto samples = from.samples();
  // The oldest may be dropped meanwhile, but there always is a newest.
  const Sample* oldest = samples.sample(samples.oldest());
  return {id,
          oldest == nullptr ? edge.stamp : std::min(oldest->stamp, edge.stamp),
          edge.stamp,
          samples.reach(edge.number),
          edge.unsampled(),
          edge.lacks_sample()};
}

std::vector<DatedEdge> dynamic_edges(const std::vector<Ends>& segments) {
  std::vector<DatedEdge> found;
  for_each_held(segments, [&](const HeldVersion& edge) {
    if (edge.moving()) found.push_back(dated(edge.name->text, OwnEdge{&edge}));
  });
  return found;
}

std::vector<DatedEdge> dynamic_edges(const Ends& ends, RemoteReading& others) {
  std::vector<DatedEdge> found;
  for_each_edge(ends, others, [&](const Version& here, const auto& edge) {
    if (edge.version != nullptr && edge.version->moving()) {
      found.push_back(dated(here.name->text, edge));
    }
  });
  return found;
}

// Writes instants, and how long ago they were if the clock can be that of their stamps.
class Wording {
 public:
  explicit Wording(const Forest::Clock& clock) : now_(clock ? clock() : std::nullopt) {}

  [[nodiscard]] std::string instant(std::int64_t t) const {
    return readable(time_of(t)) + (is_near(t) ? " (" + age(t) + ")" : "");
  }
  [[nodiscard]] std::string span(std::int64_t from, std::int64_t to) const {
    if (from == to) return instant(to);
    const std::string ages =
        is_near(from) && is_near(to) ? " (" + age(from) + " to " + age(to) + ")" : "";
    std::string begin = readable(time_of(from));
    std::string end = readable(time_of(to));
    // "2026-11-26 07:12:03.123 to 07:12:15.234 UTC".
    constexpr std::size_t kDate = 11;
    constexpr std::string_view kZone = " UTC";
    if (begin.size() == end.size() && begin.size() > kDate + kZone.size() &&
        begin.compare(0, kDate, end, 0, kDate) == 0) {
      begin.resize(begin.size() - kZone.size());
      end.erase(0, kDate);
    }
    return begin + " to " + end + ages;
  }

 private:
  // Stamps that are further away are of another clock.
  [[nodiscard]] bool is_near(std::int64_t t) const {
    constexpr std::int64_t kDay = 86'400'000'000'000;
    return now_ && std::abs(saturating_subtract(nanoseconds(*now_), std::max(t, kNoSample))) < kDay;
  }
  [[nodiscard]] std::string age(std::int64_t t) const {
    const std::chrono::nanoseconds ago(nanoseconds(*now_) - t);
    if (ago.count() == 0) return "now";
    return ago.count() > 0 ? readable(ago) + " ago" : "in " + readable(-ago);
  }

  const std::optional<Time> now_;
};

std::string gap(std::int64_t from, std::int64_t to) {
  return readable(std::chrono::nanoseconds(saturating_subtract(to, from)));
}

// Why an edge has no data after its newest sample.
std::string beyond(const DatedEdge& edge, std::int64_t t, const Query& query) {
  std::string text = "its newest sample is " + gap(edge.newest, t) + " older";
  if (query.extrapolate.count() == 0) return text;
  if (saturating_subtract(t, edge.newest) > query.extrapolate.count())
    return text + ", and the extrapolation limit is " + readable(query.extrapolate);
  if (edge.oldest == edge.newest) return text + ", and the only one: cannot extrapolate";
  if (edge.reach == 0) {
    return text +
           ", and a stamp of its last two is that of their arrival: this tells no velocity by "
           "which "
           "to extrapolate";
  }
  return text + ", and its last two samples are too close together to extrapolate by more than " +
         (edge.reach < 1'000'000 ? std::to_string(edge.reach) + " ns"
                                 : readable(std::chrono::nanoseconds(edge.reach)));
}

// The edge with the oldest newest sample, of those that cannot be extrapolated until t.
const DatedEdge& first_to_end(const std::vector<DatedEdge>& edges, const DatedEdge& slowest,
                              std::int64_t t, const Query& query) {
  const DatedEdge* found = nullptr;
  for (const DatedEdge& one : edges) {
    const bool ends = t > one.newest && saturating_subtract(t, one.newest) >
                                            std::min(query.extrapolate.count(), one.reach);
    if (ends && (found == nullptr || one.newest < found->newest)) found = &one;
  }
  return found != nullptr ? *found : slowest;
}

// When all of these edges have data.
std::string all_of(const std::vector<DatedEdge>& edges, const DatedEdge& youngest,
                   const DatedEdge& slowest, const Wording& wording) {
  if (edges.size() < 2) return {};
  const std::string all = std::to_string(edges.size()) + " dynamic edges here have ";
  if (youngest.oldest <= slowest.newest) {
    return "; all " + all + "data from " + wording.span(youngest.oldest, slowest.newest);
  }
  return "; the " + all + "no instant in common: " + slowest.name() + " has samples until " +
         wording.instant(slowest.newest) + ", " + youngest.name() + " from " +
         wording.instant(youngest.oldest) + " on";
}

Error explained_by(Error error, std::vector<DatedEdge> edges, const Query& query,
                   const Forest::Clock& clock) {
  // At the latest common time, an edge that had no sample yet has its first value.
  const auto lacks = std::find_if(edges.begin(), edges.end(), [&](const DatedEdge& one) {
    return one.lacks_sample && (query.at || !one.unsampled);
  });
  if (lacks != edges.end()) {
    error.frame = lacks->id;
    error.message = lacks->name() + " has had no sample " +
                    (lacks->unsampled ? "yet" : "since its history was cleared");
    return error;
  }
  edges.erase(std::remove_if(edges.begin(), edges.end(),
                             [](const DatedEdge& one) { return one.unsampled; }),
              edges.end());
  const auto later = [](const DatedEdge& a, const DatedEdge& b) { return a.oldest < b.oldest; };
  const auto slower = [](const DatedEdge& a, const DatedEdge& b) { return a.newest < b.newest; };
  const auto youngest = std::max_element(edges.begin(), edges.end(), later);
  const auto slowest = std::min_element(edges.begin(), edges.end(), slower);
  if (youngest == edges.end()) {
    error.message = "an edge of the path has no data";
    return error;
  }
  const Wording wording(clock);
  const std::int64_t t = query.at ? nanoseconds(*query.at) : slowest->newest;
  const bool is_old = error.code == Errc::kTooOld;
  const DatedEdge& limiting = is_old ? *youngest : first_to_end(edges, *slowest, t, query);
  error.message = query.at ? "" : "there is no latest common time: ";
  error.message += limiting.name() + " has no data for " + wording.instant(t) + ": ";
  if (!is_old) {
    error.message += beyond(limiting, t, query);
  } else if (limiting.oldest > t) {
    error.message += "its oldest sample is " + gap(t, limiting.oldest) + " later";
  } else {
    error.message += "it is no longer kept";
  }
  error.frame = limiting.id;
  if (youngest->oldest <= slowest->newest) {
    error.available = Interval{time_of(youngest->oldest), time_of(slowest->newest)};
  }
  const bool single = limiting.oldest == limiting.newest;
  error.message += std::string("; it has ") + (single ? "one sample, of " : "samples from ") +
                   wording.span(limiting.oldest, limiting.newest) +
                   all_of(edges, *youngest, *slowest, wording);
  return error;
}

}  // namespace

Error explained(Error error, const std::vector<Ends>& segments, const Query& query,
                const Forest::Clock& clock) {
  if (!error.message.empty()) return error;
  return explained_by(std::move(error), dynamic_edges(segments), query, clock);
}

Error explained(Error error, const Ends& ends, RemoteReading& others, const Query& query,
                const Forest::Clock& clock) {
  if (!error.message.empty() || (error.code != Errc::kNotYet && error.code != Errc::kTooOld)) {
    return error;
  }
  return explained_by(std::move(error), dynamic_edges(ends, others), query, clock);
}

}  // namespace tfdude
