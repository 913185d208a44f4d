#pragma once

#include <cstddef>
#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/frame.hpp"

#include "faults/model.hpp"

// The frames of a run, and the meaning of answers about them. For real and for simulated processes.
namespace tfdude::faults {

/// The frame that each partition is configured with, below the world of the first.
[[nodiscard]] std::string base_of(std::size_t partition);
[[nodiscard]] std::string partition_name(std::size_t partition);
/// The value of the edge from the world to a base.
[[nodiscard]] Transform base_edge(std::size_t partition);
/// One of the frames that all clients change, so that no client knows their result.
[[nodiscard]] std::string contested_frame(std::size_t number);

/// The world and the bases of so many partitions, which always exist.
void fix_bases(Model& model, std::size_t partitions);

/// Whether the error says that something does not exist or is not allowed. It may be right, or come
/// from a replica or an owner that is not up to date.
[[nodiscard]] bool denies(Errc code);
/// For a call to a single owner: whether the owner is known to be unreachable, and was not asked.
[[nodiscard]] bool never_asked(const Error& error);

/// Where a frame was seen; null: nowhere.
[[nodiscard]] std::string describe(const Frame* seen);
/// Empty if a frame agrees with its model; otherwise its actual state.
[[nodiscard]] std::string misplaced(const std::string& id, const Model::Frame& model,
                                    const Frame* seen);

}  // namespace tfdude::faults
