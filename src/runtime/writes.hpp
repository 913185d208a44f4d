#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// What a participant changes of frames, its own and those of others: their structure, their values, what is kept of them.
/// What each returns is said at Client.
/// @par Thread safety  All functions.
class Writes {
 public:
  Writes(Structure& structure, Discovery& discovery, Requests& requests, Transport& transport,
         MemberRunner& member)
      : structure_(structure),
        discovery_(discovery),
        requests_(requests),
        transport_(transport),
        member_(member) {}

  [[nodiscard]] Result<void> add(const std::string& id, const AddRequest& request,
                                 const std::string& partition);
  [[nodiscard]] Result<void> remove(const std::string& id);
  [[nodiscard]] Result<void> move(const std::string& id, const MoveRequest& request);
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges,
                                    std::optional<Time> stamp);
  [[nodiscard]] Result<void> update(const std::vector<PartialUpdate>& edges,
                                    std::optional<Time> stamp);
  [[nodiscard]] Result<void> publish(const std::vector<EdgeUpdate>& edges,
                                     std::optional<Time> stamp);
  [[nodiscard]] Result<void> correlate(const std::string& id, const Correlation& correlation);
  [[nodiscard]] Result<void> forget(const std::string& partition);

  /// Of an update of what is here: whether it concerns what others hold.
  static bool is_elsewhere(const Error& error) {
    return error.code == Errc::kUnknownFrame || error.code == Errc::kNotOwner;
  }

 private:
  [[nodiscard]] Result<void> change(Part part, const Deadline& deadline);
  [[nodiscard]] Result<void> publish_to(const Part& part, const Update& share,
                                        const Deadline& deadline);
  [[nodiscard]] Result<std::vector<Part>> route_forget(const std::string& partition);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  Transport& transport_;
  MemberRunner& member_;
};

}  // namespace tfdude
