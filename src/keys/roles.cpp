#include "tfdude/keys/roles.hpp"

#include "tfdude/base/id.hpp"

namespace tfdude {

// The DDS partitions of replies and pushed values are named PARTITION/RECEIVER, so the partition
// 'a' could publish in those of 'a/b'. A space at an end can get lost in XML.
Result<void> check_partition_with_keys(const std::string& name) {
  if (auto ok = check_partition_name(name); !ok) return ok;
  const std::string rejected = "partition " + quote(name) + " cannot have keys: it ";
  if (name.find('/') != std::string::npos) return fail(Errc::kInvalidInput, rejected + "holds '/'");
  if (name.front() != ' ' && name.back() != ' ') return {};
  return fail(Errc::kInvalidInput, rejected + "begins or ends with a space");
}

namespace {

std::string listed(const std::set<std::string>& partitions) {
  std::string text = partitions.size() == 1 ? "partition" : "partitions";
  const char* separator = " ";
  for (const std::string& partition : partitions) {
    text += separator + quote(partition);
    separator = ", ";
  }
  return text;
}

}  // namespace

Result<Roles> complete(Roles roles) {
  if (roles.serves) {
    if (auto ok = check_partition_with_keys(*roles.serves); !ok) return tl::unexpected(ok.error());
  }
  for (const auto* partitions : {&roles.move, &roles.stream}) {
    for (const std::string& partition : *partitions) {
      if (auto ok = check_partition_with_keys(partition); !ok) return tl::unexpected(ok.error());
    }
  }
  if (roles.serves || !roles.move.empty() || roles.observe) roles.look = true;
  for (const std::string& partition : roles.move) roles.stream.erase(partition);
  if (!roles.look && roles.stream.empty() && !roles.clock) {
    return fail(Errc::kInvalidInput,
                "no role is given: look, move, stream, observe or publish-clock");
  }
  return roles;
}

std::vector<std::string> in_words(const Roles& roles) {
  std::vector<std::string> words;
  if (roles.serves) {
    words.push_back("serves partition " + quote(*roles.serves) +
                    ": answers requests, accepts changes and streams");
  }
  if (roles.look) {
    words.emplace_back("looks: asks all partitions for poses, joints and paths, and watches them");
  } else {
    words.emplace_back("sees the structure only: partitions, frames and parents");
  }
  if (!roles.move.empty()) {
    words.push_back("moves: changes " + listed(roles.move) + ": frames, values and joints");
  }
  if (!roles.stream.empty()) {
    words.push_back("streams values and joints to " + listed(roles.stream));
  }
  if (roles.observe) {
    words.emplace_back(
        "observes: sends observations to all partitions; nothing keeps it from other changes "
        "there");
  }
  if (roles.clock) words.emplace_back("publishes the time of external clocks");
  return words;
}

}  // namespace tfdude
