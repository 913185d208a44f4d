#include <chrono>
#include <poll.h>

#include "memory/one_shot_socket.hpp"
#include "memory/unix_socket.hpp"

namespace tfdude {
namespace {

// On an idle computer it takes 0.1 ms.
constexpr std::chrono::milliseconds kAnswerOnceIn{10};

// One may know what another one does not, such as of its own joints.
constexpr int kMostAsked = 4;

}  // namespace

std::optional<OneShotAnswer> ask_once(const std::string& network, const OneShotQuestion& question) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + kAnswerOnceIn;
  const std::string message = one_shot_message(question);
  int asked = 0;
  for (int number = 0; number < kOneShotNames && asked < kMostAsked; ++number) {
    const auto socket = connect_to(one_shot_name(network, number));
    // The name may have been taken by another user.
    if (!socket || !is_of_this_user(*socket) || !send_message(*socket, message)) continue;
    ++asked;
    pollfd answer{socket->get(), POLLIN, 0};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0 || poll(&answer, 1, static_cast<int>(left.count())) != 1) return {};
    if (auto found = one_shot_answer(receive_message(*socket, kMaxOneShotBytes))) return found;
  }
  return {};
}

}  // namespace tfdude
