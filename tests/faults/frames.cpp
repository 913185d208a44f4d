#include "faults/frames.hpp"

#include <algorithm>

namespace tfdude::faults {

std::string partition_name(std::size_t partition) { return "p" + std::to_string(partition); }
std::string base_of(std::size_t partition) { return "base_" + std::to_string(partition); }
std::string contested_frame(std::size_t number) { return "shared_" + std::to_string(number); }

Transform base_edge(std::size_t partition) {
  const double x = static_cast<double>(partition) + 1.0;
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {x, -x, 0.25}), {}};
}

void fix_bases(Model& model, std::size_t partitions) {
  model.fix("world", partition_name(0), {});
  for (std::size_t i = 0; i < partitions; ++i) {
    model.fix(base_of(i), partition_name(i), {"world", base_edge(i)});
  }
}

bool denies(Errc code) {
  switch (code) {
    case Errc::kUnknownFrame:
    case Errc::kUnknownStart:
    case Errc::kUnknownEnd:
    case Errc::kUnknownParent:
    case Errc::kUnknownPartition:
    case Errc::kNotConnected:
    case Errc::kAlreadyExists:
    case Errc::kCycle:
    case Errc::kInvalidInput:
      return true;
    default:
      return false;
  }
}

bool never_asked(const Error& error) {
  return error.code == Errc::kUnreachable && error.message.find(" since ") != std::string::npos;
}

std::string describe(const Frame* seen) {
  if (seen == nullptr) return "none";
  return "under '" + seen->parent + "' in " + seen->partition + (seen->attached ? "" : ", loose");
}

std::string misplaced(const std::string& id, const Model::Frame& model, const Frame* seen) {
  if (seen == nullptr) return model.may_be_gone() ? "" : id + " is missing";
  const bool allowed =
      std::any_of(model.possible.begin(), model.possible.end(),
                  [&](const auto& place) { return place && place->parent == seen->parent; });
  if (!model.may_be_there()) return id + ", which was removed, is " + describe(seen);
  if (!allowed || seen->partition != model.partition) return id + " is " + describe(seen);
  return "";
}

}  // namespace tfdude::faults
