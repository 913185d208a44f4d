#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/recording/recording.hpp"

// What a page is told of a recording. Without threads.
namespace tfdude::web {

/// A message to a page.
struct Told {
  bool binary = false;
  std::string bytes;
};

/// A recording as a page sees it: at an instant, what was known then. Each picture is complete, so
/// that the page can go anywhere.
/// @par Memory  As Recording, and twice the messages of a picture.
/// @par Thread safety  One thread at a time.
class RecordedView {
 public:
  /// A page draws so many frames.
  static constexpr std::size_t kMostFrames = 50'000;

  /// @return as Recording::open(), naming no file; kConfig: it is empty
  [[nodiscard]] static Result<RecordedView> open(const std::string& file);
  /// The same of bytes in memory.
  [[nodiscard]] static Result<RecordedView> read(std::string_view bytes);

  /// What a page is told first: the span of the recording, and its events. Reads the whole file if
  /// it does not tell where its events are, but no recording of ROS, which has none.
  [[nodiscard]] std::vector<Told> begin();
  /// The picture of an instant, or of the nearest one that the recording has; B in A, unless the
  /// names are empty. The structure and the joints are left out if they are those of the last one.
  /// @return kTooMuch: more than kMostFrames
  [[nodiscard]] Result<std::vector<Told>> at(Time instant, const std::string& a,
                                             const std::string& b);

 private:
  explicit RecordedView(Recording recording, RecordingSummary summary)
      : recording_(std::move(recording)), summary_(std::move(summary)) {}
  [[nodiscard]] static Result<RecordedView> of(Result<Recording> recording);

  [[nodiscard]] std::string joints() const;

  Recording recording_;
  RecordingSummary summary_;
  std::uint32_t structure_ = 0;  // its number
  std::string structure_text_;   // without the number
  std::string joints_;
};

}  // namespace tfdude::web
