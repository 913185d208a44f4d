#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/types/change.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/partition_news.hpp"

namespace tfdude {

/// How a recording is written.
struct RecordingOptions {
  /// A file that has reached one of these limits is finished, and another one is begun:
  /// robot.mcap, robot_1.mcap, robot_2.mcap ... Each can be read alone.
  std::uint64_t split_bytes = std::uint64_t{4} << 30U;
  Milliseconds split_after = Milliseconds::max();
  bool compress = true;
};

/// Writes what a watch of partitions reports into MCAP files (docs/recording.md).
///
/// The file can be read at any time up to the last flush, also if the process is killed. If it
/// cannot be written, for example because the disk is full, every call fails with the reason, and
/// what was written stays readable.
/// @par Memory  The newest values of all edges, one chunk of 4 MB, and about 200 bytes for each
///   chunk of a file.
/// @par Thread safety  One thread at a time.
class TFDUDE_EXPORT RecordingWriter {
 public:
  /// Creates the file. @return kAlreadyExists; kInvalidInput: it cannot be written
  [[nodiscard]] static Result<RecordingWriter> create(const std::string& file, Time now,
                                                      const RecordingOptions& options = {});
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  /// Finishes the file.
  ~RecordingWriter();

  /// @param now  when it was heard, by the clock of the stamps. If it goes back by more than a
  ///   second, as a simulation does that starts again, another file is begun; by less, it is
  ///   treated as the last time.
  [[nodiscard]] Result<void> add(const PartitionNews& news, Time now);
  /// All joints of a partition; ignored if nothing has changed.
  [[nodiscard]] Result<void> add(const std::string& partition, const std::vector<JointInfo>& joints,
                                 Time now);
  [[nodiscard]] Result<void> add(const Change& change, Time now);

  /// Writes what waits for a chunk to be full. What was added since the last call is lost if the
  /// process is killed.
  [[nodiscard]] Result<void> flush(Time now);

  /// Writes the summary, which makes opening the file faster.
  [[nodiscard]] Result<void> finish(Time now);

  [[nodiscard]] std::vector<std::string> files() const;
  [[nodiscard]] std::uint64_t bytes() const;      ///< of all files
  [[nodiscard]] std::uint64_t raw_bytes() const;  ///< of all messages, before compression
  [[nodiscard]] std::uint64_t messages() const;

 private:
  class Impl;
  explicit RecordingWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tfdude
