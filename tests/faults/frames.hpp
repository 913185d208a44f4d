#pragma once

#include <cstddef>
#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/frame.hpp"

#include "faults/model.hpp"

// The frames of a run, and what answers about them mean. For real processes and for simulated ones.
namespace tfdude::faults {

/// The frame that each partition is configured with, below the world of the first.
[[nodiscard]] std::string base_of(std::size_t partition);
[[nodiscard]] std::string partition_name(std::size_t partition);
/// Of the edge from the world to a base.
[[nodiscard]] Transform base_edge(std::size_t partition);
/// One of the frames that all clients change, so that nobody knows what becomes of them.
[[nodiscard]] std::string contested_frame(std::size_t number);

/// The world and the bases of so many partitions are always there.
void fix_bases(Model& model, std::size_t partitions);

/// Whether it says that something is not there or may not be: by a replica or an owner that is
/// behind, or rightly.
[[nodiscard]] bool denies(Errc code);
/// Whether the owner is known to be away, and was not asked therefore: of a call to a single owner.
[[nodiscard]] bool never_asked(const Error& error);

/// Where a frame was seen; null: nowhere.
[[nodiscard]] std::string describe(const Frame* seen);
/// Empty where a frame is as its model says; else how it is.
[[nodiscard]] std::string misplaced(const std::string& id, const Model::Frame& model,
                                    const Frame* seen);

}  // namespace tfdude::faults
