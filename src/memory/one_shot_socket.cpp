#include "memory/one_shot_socket.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "memory/unix_socket.hpp"

namespace tfdude {
namespace {

using Clock = std::chrono::steady_clock;

// How many are listened to at once; others wait for one of these to leave.
constexpr std::size_t kMostAsking = 16;
// How long they may take to ask.
constexpr std::chrono::milliseconds kPatienceWithAsker{50};
// How long nobody is admitted if that is not possible.
constexpr std::chrono::milliseconds kRestFromAskers{100};

class LinuxOneShotSocket final : public OneShotSocket {
 public:
  LinuxOneShotSocket(Descriptor listening, Descriptor wake, Answer answer)
      : listening_(std::move(listening)),
        wake_(std::move(wake)),
        answer_(std::move(answer)),
        thread_([this] {
          (void)pthread_setname_np(pthread_self(), "tfdude-answer");
          run();
        }) {}
  ~LinuxOneShotSocket() override {
    const std::uint64_t one = 1;
    (void)!write(wake_.get(), &one, sizeof(one));
    thread_.join();
  }

 private:
  struct Asking {
    Descriptor socket;
    Clock::time_point until;
  };

  void run() {
    std::vector<pollfd> polled;
    while (true) {
      const bool rests = Clock::now() < admits_from_;
      const bool full = asking_.size() >= kMostAsking;
      polled.assign(1, {wake_.get(), POLLIN, 0});
      polled.push_back({rests || full ? -1 : listening_.get(), POLLIN, 0});
      for (const Asking& one : asking_) polled.push_back({one.socket.get(), POLLIN, 0});
      const auto most = (rests ? kRestFromAskers : kPatienceWithAsker).count();
      const int wait = rests || !asking_.empty() ? static_cast<int>(most) : -1;
      (void)poll(polled.data(), static_cast<nfds_t>(polled.size()), wait);
      if (polled[0].revents != 0) return;
      hear(polled);
      if (polled[1].revents != 0) admit();
    }
  }

  // Those that have asked, or took too long, leave.
  void hear(const std::vector<pollfd>& polled) {
    const Clock::time_point now = Clock::now();
    std::size_t i = 2;
    const auto leaves = [&](const Asking& one) {
      const bool asks = polled[i++].revents != 0;
      if (asks) answer(one.socket);
      return asks || now > one.until;
    };
    std::vector<Asking> stay;
    for (Asking& one : asking_) {
      if (!leaves(one)) stay.push_back(std::move(one));
    }
    asking_ = std::move(stay);
  }

  void admit() {
    Descriptor called = accept_one(listening_);
    if (!called.valid()) {
      // Without a free descriptor the caller would be reported again and again.
      if (errno != EAGAIN) admits_from_ = Clock::now() + kRestFromAskers;
    } else if (is_of_this_user(called)) {
      asking_.push_back({std::move(called), Clock::now() + kPatienceWithAsker});
    }
  }

  void answer(const Descriptor& socket) const {
    const std::string question = receive_message(socket, kMaxOneShotBytes);
    const std::string reply = question.empty() ? std::string() : answer_(question);
    if (!reply.empty() && reply.size() <= kMaxOneShotBytes) (void)send_message(socket, reply);
  }

  const Descriptor listening_;
  const Descriptor wake_;
  const Answer answer_;
  std::vector<Asking> asking_;
  Clock::time_point admits_from_{};
  std::thread thread_;  // last: it uses the other members
};

}  // namespace

std::unique_ptr<OneShotSocket> OneShotSocket::open(const std::string& network, Answer answer) {
  for (int number = 0; number < kOneShotNames; ++number) {
    auto listening = listen_at(one_shot_name(network, number));
    if (!listening) continue;
    Descriptor wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (!wake.valid()) return nullptr;
    try {
      return std::make_unique<LinuxOneShotSocket>(*std::move(listening), std::move(wake),
                                                  std::move(answer));
    } catch (const std::system_error&) {  // there are too many threads
      return nullptr;
    }
  }
  return nullptr;
}

}  // namespace tfdude
