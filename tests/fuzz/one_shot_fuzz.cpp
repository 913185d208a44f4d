// Passes any bytes to a process that is asked once, and to one that asks.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "tfdude/base/id.hpp"

#include "fuzz/demand.hpp"
#include "memory/one_shot.hpp"

namespace tfdude::fuzz {
namespace {

bool all_valid(const std::vector<std::string>& names) {
  bool valid = true;
  for (const std::string& name : names) valid = valid && check_id(name, "id");
  return valid;
}

void take_question(std::string_view bytes) {
  const auto question = one_shot_question(bytes);
  if (!question) return;
  demand(all_valid({question->a, question->b}), "a question has valid names");
  const auto again = one_shot_question(one_shot_message(*question));
  demand(again && again->a == question->a && again->b == question->b && again->at == question->at,
         "a question is sent as it was read");
}

void take_answer(std::string_view bytes) {
  const auto answer = one_shot_answer(bytes);
  if (!answer) return;
  const StampedTransform& X_AB = answer->X_AB;
  demand(check_finite(X_AB).has_value(), "an answer is finite");
  demand(std::abs(X_AB.pose.rotation().norm() - 1) < 1e-6, "its rotation is one");
  demand(all_valid(X_AB.basis.sources) && all_valid(X_AB.basis.unspecified),
         "an answer has valid names");
  for (const PathSegment& one : answer->path) {
    demand(all_valid({one.partition, one.from, one.to}), "a path has valid names");
  }
  const std::string sent = one_shot_message(*answer);
  const auto again = one_shot_answer(sent);
  demand(again && one_shot_message(*again) == sent, "an answer is sent as it was read");
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // NOLINTNEXTLINE(*-reinterpret-cast): bytes as characters
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  tfdude::fuzz::take_question(bytes);
  tfdude::fuzz::take_answer(bytes);
  return 0;
}
