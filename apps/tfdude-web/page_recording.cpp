#include "page_recording.hpp"

#include <utility>

#include "../rendering/json.hpp"

namespace tfdude::web {
namespace {

// Each has a file, a thread and a process.
constexpr std::chrono::seconds kUploadEvery{1};

}  // namespace

PageRecording::~PageRecording() { leave(); }

void PageRecording::tell(const std::string& error) {
  send({{false, cli::dump({{"op", "recording"}, {"error", error}})}});
}

bool PageRecording::take(const UploadRequest& request) {
  if (coming_ != nullptr) return false;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) {
    tell("wait a second before another file");
    return true;
  }
  next_ = now + kUploadEvery;
  const auto begun = all_.begin(request.bytes);
  if (!begun) {
    tell(begun.error().message);
    return true;
  }
  ignored_ = 0;
  coming_ = *begun;
  upload_.emplace(request.bytes, now);
  written({}, 0);
  return true;
}

bool PageRecording::take(std::string_view piece) {
  if (!upload_) {
    if (ignored_ == 0) return false;
    --ignored_;
    return true;
  }
  const bool first = upload_->received() == 0;
  if (!upload_->receive(piece.size(), std::chrono::steady_clock::now())) return false;
  if (const auto ok = check_beginning(piece); first && !ok) {
    drop_upload();
    tell(ok.error().message);
    return true;
  }
  coming_->write(std::string(piece), [this, size = piece.size()](const Result<void>& result) {
    written(result, size);
  });
  return true;
}

void PageRecording::written(const Result<void>& result, std::size_t size) {
  if (!result) {
    drop_upload();
    return tell(result.error().message);
  }
  upload_->write(size);
  send({{false, cli::dump({{"op", "upload"}, {"written", upload_->written()}})}});
  if (!upload_->complete()) return;
  upload_.reset();
  coming_->open([this](Result<std::vector<Told>> told) { opened(std::move(told)); });
}

void PageRecording::opened(Result<std::vector<Told>> told) {
  if (!told) {
    drop_upload();
    return tell(told.error().message);
  }
  if (shown_ != nullptr) shown_->leave();
  shown_ = std::exchange(coming_, nullptr);
  at_.reset();
  due_ = asking_ = false;
  send(*std::move(told));
}

void PageRecording::drop_upload() {
  coming_->leave();
  coming_ = nullptr;
  upload_.reset();
  ignored_ = Upload::kAhead;
}

void PageRecording::cancel() {
  if (coming_ != nullptr) drop_upload();
}

void PageRecording::leave() {
  cancel();
  if (shown_ != nullptr) shown_->leave();
  shown_ = nullptr;
}

void PageRecording::tick(bool behind) {
  if (upload_ && upload_->is_late(std::chrono::steady_clock::now())) {
    drop_upload();
    tell("the file came too slowly, or not at all");
  }
  if (shown_ == nullptr || behind || asking_ || !due_ || !at_) return;
  due_ = false;
  asking_ = true;
  shown_->show(*at_, pair_.a, pair_.b,
               [this](Result<std::vector<Told>> told) { pictured(std::move(told)); });
}

void PageRecording::pictured(Result<std::vector<Told>> told) {
  asking_ = false;
  if (told) return send(*std::move(told));
  leave();
  tell(told.error().message);
}

void PageRecording::send(std::vector<Told> told) {
  for (Told& one : told) {
    link_->send(std::make_shared<const std::string>(std::move(one.bytes)), one.binary);
  }
}

}  // namespace tfdude::web
