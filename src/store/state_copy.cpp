#include "store/state_copy.hpp"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "tfdude/base/id.hpp"

#include "store/sqlite_store.hpp"

namespace tfdude {
namespace {

namespace fs = std::filesystem;

// A checkpoint, which rewrites the file, takes some milliseconds.
constexpr int kAttempts = 20;
constexpr std::chrono::milliseconds kPause{25};

// A temporary folder that is removed with the object.
class Scratch {
 public:
  Scratch() {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "tfdude-XXXXXX").string();
    if (!error && mkdtemp(name.data()) != nullptr) path_ = name;
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Writes go to the log first, and from there to the file. So the file and a log that was copied
// after it are consistent unless the file was written meanwhile. SQLite ignores an incomplete end
// of a log.
std::error_code copy_once(const std::string& file, const std::string& copy, bool& kept_still) {
  std::error_code error;
  const auto before = fs::last_write_time(file, error);
  if (error) return error;
  fs::copy_file(file, copy, fs::copy_options::overwrite_existing, error);
  if (error) return error;
  fs::copy_file(file + "-wal", copy + "-wal", fs::copy_options::overwrite_existing, error);
  if (error == std::errc::no_such_file_or_directory) {
    fs::remove(copy + "-wal", error);
  }
  if (error) return error;
  kept_still = fs::last_write_time(file, error) == before;
  return error;
}

tl::unexpected<Error> unreadable(const std::string& file, const std::string& why) {
  return fail(Errc::kState, "state file " + quote(file) + " cannot be copied: " + why);
}

}  // namespace

Result<StoredState> read_state_copy(const std::string& file, const std::string& partition) {
  std::error_code error;
  if (!fs::exists(file, error) && !error) return StoredState{};
  if (error) return unreadable(file, error.message());
  const Scratch scratch;
  if (scratch.path().empty()) return unreadable(file, "there is no folder for temporary files");
  const std::string copy = scratch.path() + "/copy.sqlite";
  bool kept_still = false;
  for (int attempt = 0; attempt < kAttempts && !kept_still; ++attempt) {
    if (attempt > 0) std::this_thread::sleep_for(kPause);
    if (const auto failed = copy_once(file, copy, kept_still))
      return unreadable(file, failed.message());
  }
  if (!kept_still) return unreadable(file, "it changed during each attempt");
  auto store = open_sqlite_store(copy, partition);
  auto state = store ? (*store)->load() : tl::unexpected(std::move(store.error()));
  if (state) return state;
  Error refused = std::move(state.error());
  if (const auto at = refused.message.find(copy); at != std::string::npos) {
    refused.message.replace(at, copy.size(), file);
  }
  return tl::unexpected(std::move(refused));
}

}  // namespace tfdude
