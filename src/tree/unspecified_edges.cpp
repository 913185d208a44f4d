#include "tree/unspecified_edges.hpp"

#include <iterator>
#include <utility>

namespace tfdude {
namespace {

bool is_unspecified(const Sample* sample) { return sample == nullptr || !sample->complete(); }
bool is_unspecified(const HeldVersion& edge) { return !edge.X_PC.covariance.complete(); }

// Whether a sample that the value at that instant is computed from is unspecified. One that was
// dropped meanwhile may have been.
bool is_unspecified_at(const HeldVersion& edge, std::int64_t t) {
  if (!edge.moving() || edge.unsampled() || t == edge.stamp) return is_unspecified(edge);
  if (t > edge.stamp) {
    return is_unspecified(edge) || is_unspecified(edge.samples->sample(edge.number - 1));
  }
  std::uint64_t back = 0;
  const auto found = edge.samples->around(t, edge.number, back);
  if (is_unspecified(found.before)) return true;
  return found.before->stamp != t && is_unspecified(found.after);
}

}  // namespace

std::vector<std::string> unspecified_edges(const Ends& ends, std::int64_t t) {
  std::vector<std::string> up;
  std::vector<std::string> down;  // from b
  const Version* a = ends.a;
  const Version* b = ends.b;
  while (a != b) {
    const bool from_a = a->depth >= b->depth;
    const Version*& here = from_a ? a : b;
    if (here->above == nullptr) break;
    const bool named = here->held() && is_unspecified_at(static_cast<const HeldVersion&>(*here), t);
    if (named) (from_a ? up : down).push_back(here->name->text);
    here = Frames::at(*here->above, ends.commit);
  }
  up.insert(up.end(), std::make_move_iterator(down.rbegin()), std::make_move_iterator(down.rend()));
  return up;
}

}  // namespace tfdude
