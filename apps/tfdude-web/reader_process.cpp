#include "reader_process.hpp"

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fcntl.h>
#include <new>
#include <optional>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "../rendering/json.hpp"

namespace tfdude::web {
namespace {

using Clock = std::chrono::steady_clock;

// Descriptors of the process.
constexpr int kSocket = STDIN_FILENO;
constexpr int kFile = STDERR_FILENO + 1;
constexpr int kNice = 5;

// A question is its length and JSON. An answer is messages, each its length and its bytes, and one
// of the ends; after that of an error, its text likewise.
constexpr std::uint32_t kBinary = 1U << 31U;
constexpr std::uint32_t kEnd = 0xffffffff;
constexpr std::uint32_t kError = 0xfffffffe;
constexpr std::uint32_t kMostQuestion = 4096;                    // [B]
constexpr std::uint32_t kMostAnswer = std::uint32_t{16} << 20U;  // [B]

// Without a deadline, waits for ever. @return false: the other side has closed, or is too late
bool wait_for(int socket, short events, const std::optional<Clock::time_point>& deadline) {
  while (true) {
    int left = -1;
    if (deadline) {
      const auto rest =
          std::chrono::ceil<std::chrono::milliseconds>(*deadline - Clock::now()).count();
      if (rest <= 0) return false;
      left = static_cast<int>(rest);
    }
    pollfd entry{socket, events, 0};
    const int ready = poll(&entry, 1, left);
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

bool receive(int socket, void* place, std::size_t count,
             const std::optional<Clock::time_point>& deadline) {
  auto* bytes = static_cast<char*>(place);
  while (count > 0) {
    if (!wait_for(socket, POLLIN, deadline)) return false;
    const ssize_t got = recv(socket, bytes, count, MSG_DONTWAIT);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (got <= 0) return false;
    bytes += got;
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

bool send_all(int socket, std::string_view bytes,
              const std::optional<Clock::time_point>& deadline) {
  while (!bytes.empty()) {
    if (!wait_for(socket, POLLOUT, deadline)) return false;
    const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

void put(std::string& bytes, std::uint32_t number) {
  char raw[sizeof(number)];
  std::memcpy(raw, &number, sizeof(number));
  bytes.append(raw, sizeof(number));
}

// A text after its length.
std::optional<std::string> receive_text(int socket, std::uint32_t most,
                                        const std::optional<Clock::time_point>& deadline) {
  std::uint32_t size = 0;
  if (!receive(socket, &size, sizeof(size), deadline) || size > most) {
    return std::nullopt;
  }
  std::string text(size, '\0');
  if (!receive(socket, text.data(), size, deadline)) return std::nullopt;
  return text;
}

// Before anything of the file is read. The robot comes first: for time, and for memory.
void limit_process(std::uint64_t memory) {
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
  (void)setpriority(PRIO_PROCESS, 0, kNice);
  const int adjustment = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (adjustment >= 0) {
    (void)(write(adjustment, "1000", 4) < 0);
    close(adjustment);
  }
  const rlimit no_core{0, 0};
  (void)setrlimit(RLIMIT_CORE, &no_core);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const rlimit space{memory, memory};
  (void)setrlimit(RLIMIT_AS, &space);
#else
  (void)memory;  // a sanitizer's shadow is larger
#endif
}

std::string encode(const Result<std::vector<Told>>& told) {
  std::string answer;
  for (const Told& one : told ? *told : std::vector<Told>()) {
    put(answer, static_cast<std::uint32_t>(one.bytes.size()) | (one.binary ? kBinary : 0U));
    answer += one.bytes;
  }
  put(answer, told ? kEnd : kError);
  if (told) return answer;
  const std::string why =
      cli::dump({{"code", static_cast<int>(told.error().code)}, {"message", told.error().message}});
  put(answer, static_cast<std::uint32_t>(why.size()));
  return answer + why;
}

Result<std::vector<Told>> answer_to(const std::string& question, RecordedView& view) {
  const auto json = nlohmann::json::parse(question);
  if (json.empty()) return view.begin();
  return view.at(time_of(json.at("at").get<std::int64_t>()), json.at("a").get<std::string>(),
                 json.at("b").get<std::string>());
}

// One message of an answer, or its end. @return null: the process has failed
std::optional<std::uint32_t> receive_message(int socket, Clock::time_point deadline,
                                             std::size_t& left, std::vector<Told>& told) {
  std::uint32_t head = 0;
  if (!receive(socket, &head, sizeof(head), deadline)) return std::nullopt;
  if (head == kEnd || head == kError) return head;
  const std::size_t size = head & ~kBinary;
  if (size > left) return std::nullopt;
  left -= size;
  Told& one = told.emplace_back();
  one.binary = (head & kBinary) != 0;
  one.bytes.resize(size);
  if (!receive(socket, one.bytes.data(), size, deadline)) return std::nullopt;
  return head;
}

}  // namespace

int read_recording() {
  limit_process(ReaderProcess::kMostMemory);
  try {
    auto view = RecordedView::open("/proc/self/fd/" + std::to_string(kFile));
    while (const auto question = receive_text(kSocket, kMostQuestion, std::nullopt)) {
      const auto told = view ? answer_to(*question, *view)
                             : Result<std::vector<Told>>(tl::unexpected(view.error()));
      if (!send_all(kSocket, encode(told), std::nullopt)) break;
    }
  } catch (const std::bad_alloc&) {  // what was read is freed
    const auto error = fail(Errc::kTooMuch, "reading the file takes too much memory");
    (void)send_all(kSocket, encode(error), std::nullopt);
  }
  return 0;
}

Result<std::unique_ptr<ReaderProcess>> ReaderProcess::start(int file) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    return fail(Errc::kTooMuch, "the server has no socket for the reader of the file");
  }
  // Not one of the numbers that are made below.
  const int theirs = fcntl(ends[1], F_DUPFD_CLOEXEC, kFile + 1);
  close(ends[1]);
  if (theirs < 0) {
    close(ends[0]);
    return fail(Errc::kTooMuch, "the server has no descriptor for the reader of the file");
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, file, kFile);
  posix_spawn_file_actions_adddup2(&actions, theirs, kSocket);
  // The process would keep connections open that the server closes.
  posix_spawn_file_actions_addclosefrom_np(&actions, kFile + 1);
  std::string program = "tfdude-web";
  std::string argument = kReaderArgument;
  char* argv[] = {program.data(), argument.data(), nullptr};
  pid_t pid = 0;
  const int failed = posix_spawn(&pid, "/proc/self/exe", &actions, nullptr, argv, environ);
  posix_spawn_file_actions_destroy(&actions);
  close(theirs);
  if (failed != 0) {
    close(ends[0]);
    return fail(Errc::kTooMuch, "the server cannot start a reader of the file");
  }
  return std::unique_ptr<ReaderProcess>(new ReaderProcess(ends[0], pid));
}

Result<std::vector<Told>> ReaderProcess::begin() { return ask("{}"); }

Result<std::vector<Told>> ReaderProcess::at(Time instant, const std::string& a,
                                            const std::string& b) {
  return ask(cli::dump({{"at", nanoseconds(instant)}, {"a", a}, {"b", b}}));
}

Result<std::vector<Told>> ReaderProcess::ask(const std::string& question) {
  const auto deadline = Clock::now() + kAnswerTime;
  std::string bytes;
  put(bytes, static_cast<std::uint32_t>(question.size()));
  std::vector<Told> told;
  std::optional<std::uint32_t> last;
  if (send_all(socket_, bytes + question, deadline)) {
    std::size_t left = kMostAnswer;
    do {
      last = receive_message(socket_, deadline, left, told);
    } while (last && *last < kError);
  }
  if (last == kEnd) return told;
  if (last == kError) {
    const auto why = receive_text(socket_, kMostAnswer, deadline);
    const auto json = nlohmann::json::parse(why.value_or(""), nullptr, false);
    end();
    if (!json.is_object()) return fail(Errc::kConfig, "the file cannot be read");
    return fail(static_cast<Errc>(json.value("code", static_cast<int>(Errc::kConfig))),
                json.value("message", ""));
  }
  const bool late = Clock::now() >= deadline;
  end();
  if (late) return fail(Errc::kTooMuch, "reading the file takes too long");
  return fail(Errc::kConfig, "the file cannot be read: its reader has ended");
}

void ReaderProcess::cancel() const { (void)shutdown(socket_, SHUT_RDWR); }

void ReaderProcess::end() {
  if (pid_ == 0) return;
  kill(pid_, SIGKILL);
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
}

ReaderProcess::~ReaderProcess() {
  end();
  close(socket_);
}

}  // namespace tfdude::web
