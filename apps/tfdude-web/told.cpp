#include "told.hpp"

#include <utility>

#include "../rendering/json.hpp"

namespace tfdude::web {

std::string pair_text(const std::string& a, const std::string& b,
                      const Result<StampedTransform>& X_AB, const std::vector<PathSegment>& path,
                      bool past, const std::string& unreachable) {
  nlohmann::json json;
  nlohmann::json segments = nlohmann::json::array();
  for (const PathSegment& segment : path) {
    segments.push_back(
        {{"partition", segment.partition}, {"from", segment.from}, {"to", segment.to}});
  }
  if (X_AB) {
    json = cli::lookup_json(a, b, *X_AB, path);
    if (X_AB->stamp) json["stamp_ns"] = std::to_string(nanoseconds(*X_AB->stamp));
  } else {
    json = {{"from", a},
            {"to", b},
            {"error", X_AB.error().message},
            {"code", to_string(X_AB.error().code)}};
  }
  json["op"] = "pair";
  json["past"] = past;
  if (!unreachable.empty()) json["unreachable"] = unreachable;
  json["path"] = std::move(segments);
  return cli::dump(json);
}

std::string level_of(ChangeKind kind) {
  const bool bad = kind == ChangeKind::kPartitionDown || kind == ChangeKind::kConflict ||
                   kind == ChangeKind::kJointConflict || kind == ChangeKind::kFrameOrphaned ||
                   kind == ChangeKind::kMissed;
  return bad ? "warning" : "info";
}

nlohmann::json event_json(nlohmann::json what, Time time, const std::string& level) {
  what["time_ns"] = std::to_string(nanoseconds(time));
  what["level"] = level;
  return what;
}

}  // namespace tfdude::web
