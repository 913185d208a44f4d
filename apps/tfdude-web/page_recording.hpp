#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "recordings.hpp"
#include "request.hpp"
#include "server.hpp"
#include "upload.hpp"

namespace tfdude::web {

/// The recording that one page has sent, on its way and when it is shown instead of the robot.
/// Until it can be shown, and if it cannot, the page goes on seeing what it saw. On the server's
/// thread.
class PageRecording {
 public:
  explicit PageRecording(Recordings& all) : all_(all) {}
  ~PageRecording();
  PageRecording(const PageRecording&) = delete;
  PageRecording& operator=(const PageRecording&) = delete;

  void begin(Link& link) { link_ = &link; }
  /// Whether the page shows a recording, or the robot.
  [[nodiscard]] bool is_shown() const { return shown_ != nullptr; }

  // What the page asks. @return false: it must not ask that now

  [[nodiscard]] bool take(const UploadRequest& request);
  /// A piece of the file. After an error, those that were on their way are ignored.
  [[nodiscard]] bool take(std::string_view piece);
  void cancel();
  void leave();
  void show(Time at) { at_ = at, due_ = true; }
  void follow(PairRequest pair) { pair_ = std::move(pair), due_ = true; }

  /// Sends the picture that was asked for last. @param behind  the page has much to take yet
  void tick(bool behind);

 private:
  void drop_upload();
  void written(const Result<void>& result, std::size_t size);
  void opened(Result<std::vector<Told>> told);
  void pictured(Result<std::vector<Told>> told);
  void send(std::vector<Told> told);
  /// Tells an error; the page shows what it showed, or the robot.
  void tell(const std::string& error);

  Recordings& all_;
  Link* link_ = nullptr;
  // On its way: until all is written, and then until the process has read what it needs.
  SentRecording* coming_ = nullptr;
  std::optional<Upload> upload_;
  std::size_t ignored_ = 0;  // pieces that may still come of a file that was given up
  std::chrono::steady_clock::time_point next_;  // when another may come
  SentRecording* shown_ = nullptr;
  std::optional<Time> at_;
  PairRequest pair_;
  bool due_ = false;     // another picture
  bool asking_ = false;  // for one
};

}  // namespace tfdude::web
