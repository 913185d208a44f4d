#include "runtime/watch_server.hpp"

#include <string>
#include <utility>

#include "tfdude/base/id.hpp"

#include "runtime/member_runner.hpp"

namespace tfdude {

void WatchServer::stop() {
  stopped_ = true;
  pushes_.stop();
  job_.stop();
}

void WatchServer::push(const PushedValues& values) {
  context_.transport.push(values);
  watches_.on_pushed(values);
}

Reply WatchServer::answer(const Request& request, const std::optional<PeerId>& watcher) {
  const std::string who = "partition " + quote(context_.member.name());
  if (stopped_) return {request.sequence, 0, Error{Errc::kNotOwner, who + " is leaving"}};
  const auto& watch = std::get<WatchRequest>(request.body);
  const std::uint64_t incarnation = context_.member.incarnation();
  auto pushed =
      pushes_.watch(watch_group(context_.member.name(), incarnation, watch), watch, watcher);
  if (!pushed) {
    if (pushed.error().code == Errc::kTooMuch) pushed = fail_at(who, pushed.error());
    return {request.sequence, 0, std::move(pushed.error())};
  }
  if (correlated_entries(*pushed) > kMaxCorrelated) {
    return {request.sequence, 0,
            Error{Errc::kInvalidInput, who + " has more than " + std::to_string(kMaxCorrelated) +
                                           " edges of the path that are correlated with others"}};
  }
  return {request.sequence, 0, *std::move(pushed)};
}

}  // namespace tfdude
