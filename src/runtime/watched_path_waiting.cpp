#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "runtime/watched_path.hpp"

// Those who wait for something new of a watched path.
namespace tfdude {
namespace {

Error has_ended() { return {Errc::kTransport, "the client of this watched path has ended"}; }

}  // namespace

std::shared_ptr<void> WatchedPath::on_news(Listener listener) {
  const Lock lock(listeners_->mutex);
  const auto mine = listeners_->all.insert(listeners_->all.end(), std::move(listener));
  return {nullptr, [listeners = listeners_, mine](void*) {
            const Lock removing(listeners->mutex);
            listeners->all.erase(mine);
          }};
}

// One callback for values. Its calls are posted only if none is due.
struct WatchedPath::Values {
  std::weak_ptr<const WatchedPath> path;
  ValueCallback callback;
  std::shared_ptr<Callbacks::Line> line;
  std::atomic<bool> due{false};
  // The following belong to the calls.
  std::optional<StampedTransform> told{};
  bool failed = false;  // the last call had none

  static void post(const std::shared_ptr<Values>& values) {
    if (values->due.exchange(true)) return;
    values->line->post([values] { values->call(); });
  }
  void call() {
    due = false;
    const auto watched = path.lock();
    if (!watched || watched->left_) return;
    const auto X = watched->lookup({});
    if (X ? told && !failed && is_same_value(*told, *X) : failed) return;
    if (X) told = *X;
    failed = !X;
    callback(X);
  }
};

std::shared_ptr<void> WatchedPath::on_value(ValueCallback callback) {
  if (routes_ == nullptr) return nullptr;
  auto values = std::make_shared<Values>();
  values->path = weak_from_this();
  values->callback = std::move(callback);
  values->line = routes_->another();
  std::list<std::shared_ptr<Values>>::iterator mine;
  {
    const Lock lock(listeners_->mutex);
    mine = listeners_->values.insert(listeners_->values.end(), values);
  }
  Values::post(values);
  return {nullptr, [listeners = listeners_, mine, values](void*) {
            {
              const Lock removing(listeners->mutex);
              listeners->values.erase(mine);
            }
            values->line->close();
          }};
}

void WatchedPath::tell() {
  changed_.notify_all();
  std::vector<std::shared_ptr<Values>> values;
  {
    const Lock lock(listeners_->mutex);
    for (const auto& listener : listeners_->all) listener();
    values.assign(listeners_->values.begin(), listeners_->values.end());
  }
  for (const auto& one : values) Values::post(one);
}

bool WatchedPath::wait_for_more(std::uint64_t messages, Clock::time_point deadline) const {
  return wait_for_news({messages, UINT64_MAX}, deadline);
}

bool WatchedPath::wait_for_news(const Heard& before, Clock::time_point deadline) const {
  const auto is_new = [&] {
    const Heard now = heard();
    return now.messages > before.messages || now.ends > before.ends;
  };
  Lock lock(mutex_);
  changed_.wait_until(lock, deadline, [&]() TFDUDE_REQUIRES(mutex_) { return ended_ || is_new(); });
  return is_new();
}

void WatchedPath::end_waits() {
  {
    const Lock lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
}

std::optional<Error> WatchedPath::ended() const {
  const Lock lock(mutex_);
  return ended_ ? std::optional(has_ended()) : std::nullopt;
}

Result<void> WatchedPath::wait_until_live(Clock::time_point deadline) const {
  Lock lock(mutex_);
  changed_.wait_until(lock, deadline, [&]() TFDUDE_REQUIRES(mutex_) {
    return ended_ || in_memory() || (followed_ != nullptr && !followed_->lacks_history());
  });
  if (live()) return {};
  return tl::unexpected(ended_ ? has_ended() : why_not_);
}

}  // namespace tfdude
