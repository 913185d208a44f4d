#pragma once

namespace tfdude::cli {

/// Becomes the program tfdude-web, which is beside this one, with all arguments after the first.
/// @return only if that fails: the exit status
[[nodiscard]] int become_web(int argc, char** argv);

}  // namespace tfdude::cli
