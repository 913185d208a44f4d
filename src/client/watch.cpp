#include "tfdude/client/watch.hpp"

#include <optional>
#include <utility>

#include "runtime/deadline.hpp"
#include "runtime/watched_path.hpp"

namespace tfdude {

Result<StampedTransform> PathWatch::lookup(const Query& query) const {
  return path_->lookup(query);
}

Result<StampedTransform> PathWatch::at(Time t) const {
  Query query;
  query.at = t;
  return path_->lookup(query);
}

Result<void> PathWatch::health() const { return path_->health(); }

std::uint64_t PathWatch::messages() const { return path_->messages(); }

bool PathWatch::wait_for_more(std::uint64_t messages,
                              std::chrono::steady_clock::time_point deadline) const {
  return path_->wait_for_more(messages, deadline);
}

Result<StampedTransform> PathWatch::wait_next(Milliseconds wait) {
  const Deadline deadline(wait);
  while (true) {
    const WatchedPath::Heard heard = path_->heard();
    auto newest = latest();
    if (newest && !(returned_ && is_same_value(*returned_, *newest))) {
      returned_ = *newest;
      return newest;
    }
    // Each end is told once; the path may return. That of the client is for good.
    const bool ends = !newest && std::exchange(returned_, std::nullopt).has_value();
    if (ends || (!newest && newest.error().code == Errc::kTransport)) return newest;
    if (path_->wait_for_news(heard, deadline.at())) continue;
    if (auto ended = path_->ended()) return tl::unexpected(*std::move(ended));
    if (!newest) return newest;
    return fail(Errc::kTimeout,
                "nothing new of the " + path_->described() + " within " + deadline.text());
  }
}

Subscription PathWatch::on_value(
    std::function<void(const Result<StampedTransform>&)> callback) const {
  return Subscription(path_->on_value(std::move(callback)));
}

Subscription PathWatch::on_news(std::function<void()> listener) const {
  return Subscription(path_->on_news(std::move(listener)));
}

Result<StampedTransform> EdgesWatch::lookup(std::string_view a, std::string_view b,
                                            const Query& query) const {
  return edges_->lookup(a, b, query);
}

std::vector<Time> EdgesWatch::stamps(std::string_view id, Time after) const {
  return edges_->stamps(id, after);
}

Result<void> EdgesWatch::health() const { return edges_->health(); }

std::uint64_t EdgesWatch::messages() const { return edges_->messages(); }

bool EdgesWatch::wait_for_more(std::uint64_t messages,
                               std::chrono::steady_clock::time_point deadline) const {
  return edges_->wait_for_more(messages, deadline);
}

Subscription EdgesWatch::on_news(std::function<void()> listener) const {
  return Subscription(edges_->on_news(std::move(listener)));
}

}  // namespace tfdude
