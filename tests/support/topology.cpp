#include "support/topology.hpp"

#include <iomanip>
#include <sstream>

namespace tfdude::testing {
namespace {

constexpr std::size_t kPartitions = 5;

template <class Numbers>
void write_list(std::ostream& out, const char* key, const Numbers& numbers) {
  const char* separator = "";
  out << "    " << key << ": [";
  for (const double number : numbers) {
    out << separator << number;
    separator = ", ";
  }
  out << "]\n";
}

}  // namespace

std::string PartitionSpec::yaml() const {
  std::ostringstream out;
  out << std::setprecision(17) << "partition: " << name << "\nframes:\n";
  for (const FrameSpec& frame : frames) {
    out << "  - id: " << frame.id << "\n";
    if (frame.parent.empty()) continue;
    out << "    parent: " << frame.parent << "\n";
    const Eigen::Vector3d t = frame.X_PC.pose.translation();
    const Eigen::Vector4d q = frame.X_PC.pose.rotation().coeffs();  // x, y, z, w
    write_list(out, "xyz", t);
    write_list(out, "quat", q);
    write_list(out, "cov", frame.X_PC.covariance.of_specified().upper());
  }
  return out.str();
}

std::vector<PartitionSpec> five_partitions(Random& random, bool star) {
  std::vector<PartitionSpec> partitions;
  for (std::size_t i = 0; i < kPartitions; ++i) {
    PartitionSpec partition{"p" + std::to_string(i), {}};
    const std::size_t count = 2 + random.index(2);
    for (std::size_t k = 0; k < count; ++k) {
      const auto any = [&random](const PartitionSpec& p) {
        return p.frames[random.index(p.frames.size())].id;
      };
      std::string parent;
      if (k > 0) {
        parent = any(partition);
      } else if (i > 0) {
        parent = any(partitions[star ? 0 : i - 1]);
      }
      const std::string id = partition.name + "_" + std::string(1, static_cast<char>('a' + k));
      partition.frames.push_back(
          {id, parent, parent.empty() ? Transform::exact({}) : random.transform()});
    }
    partitions.push_back(std::move(partition));
  }
  return partitions;
}

}  // namespace tfdude::testing
