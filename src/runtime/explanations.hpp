#pragma once

#include <string>
#include <vector>

#include "tfdude/types/explanation.hpp"

#include "runtime/context.hpp"
#include "runtime/joint_calls.hpp"
#include "runtime/lookups.hpp"
#include "runtime/queries.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// Says why an answer is as it is, or why there is none. Client describes the return values.
/// @par Thread safety  All functions are thread-safe.
class Explanations {
 public:
  Explanations(const Context& context, Lookups& lookups, Queries& queries, JointCalls& joints)
      : structure_(context.structure),
        discovery_(context.discovery),
        requests_(context.requests),
        lookups_(lookups),
        queries_(queries),
        joints_(joints) {}

  [[nodiscard]] Explanation why(const std::string& a, const std::string& b, const WhyQuery& query);

 private:
  // The samples of a dynamic edge.
  struct EdgeHistory {
    std::string id;
    std::string partition;
    std::optional<Time> oldest;
    std::optional<Time> newest;
    std::uint64_t ahead = 0;  // rejected: too far ahead of the owner's clock
  };
  // What the owners of a path say.
  struct Owners {
    std::vector<std::string> order;    // of the path
    std::vector<EdgeHistory> dynamic;  // of its edges
    std::string silent;                // the first that does not answer; empty: all do
  };

  void divide(const std::string& a, const std::string& b, const WhyQuery& query,
              const Deadline& deadline, Explanation& explanation);
  [[nodiscard]] Owners owners_of(const std::vector<FrameInfo>& edges, const Deadline& deadline);
  void add_ages(const Owners& owners, const Deadline& deadline, Explanation& explanation);

  [[nodiscard]] Cause cause_of(Error error, const std::string& a, const std::string& b,
                               const WhyQuery& query, const Deadline& deadline);
  void explain_unknown(const std::string& id, Cause& cause);
  void explain_apart(const std::string& a, const std::string& b, Cause& cause);
  /// By an owner that others miss, and of which nothing else is known here.
  [[nodiscard]] bool explain_missed(const std::string& a, const std::string& b, Cause& cause);
  [[nodiscard]] std::optional<FrameInfo> top_of(const std::string& id) const;
  void explain_absent(const std::vector<FrameInfo>& edges, Cause& cause);
  void explain_time(Owners owners, const WhyQuery& query, const Deadline& deadline, Cause& cause);
  /// Absent: it does not differ, or that is not known.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> clock_ahead(const std::string& partition,
                                                                    const Deadline& deadline);
  [[nodiscard]] bool has_other_clock(const Owners& owners, Cause& cause);
  [[nodiscard]] std::string owner_name(Owner owner);
  [[nodiscard]] std::vector<std::string> names_like(const std::string& id);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  Lookups& lookups_;
  Queries& queries_;
  JointCalls& joints_;
};

}  // namespace tfdude
