#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <poll.h>
#include <random>
#include <string>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <system_error>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "memory/port.hpp"
#include "memory/unix_socket.hpp"

#ifndef F_SEAL_FUTURE_WRITE
#define F_SEAL_FUTURE_WRITE 0x0010
#endif

namespace tfdude {
namespace {

using Clock = std::chrono::steady_clock;

// How many readers an owner admits, how many it hears at once, as any user of the computer may
// call, and how long it waits for what one says first.
constexpr std::size_t kMostReaders = 1024;
constexpr std::ptrdiff_t kMostHeard = 32;
constexpr std::chrono::milliseconds kPatience{1000};
// How long it admits nobody if it cannot.
constexpr std::chrono::milliseconds kRest{100};
// How long a reader waits for the owner's answer.
constexpr std::chrono::milliseconds kAnswerIn{200};
// Larger than any owner may reserve.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 40U;

tl::unexpected<Error> unsupported(std::string why) {
  return fail(Errc::kUnsupported, std::move(why));
}
tl::unexpected<Error> refused_by_system(const char* what) {
  return unsupported(std::string(what) + " failed: " + std::strerror(errno));
}

std::uint64_t random_number() {
  std::random_device device;
  const std::uint64_t high = device();
  return high << 32U | device();
}

std::string random_name() {
  std::array<char, 48> text{};
  (void)std::snprintf(text.data(), text.size(), "tfdude-%016llx%016llx",
                      static_cast<unsigned long long>(random_number()),
                      static_cast<unsigned long long>(random_number()));
  return text.data();
}

// The same for all namespaces of one kernel, and another after each start.
std::string kernel_id() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(file, id);
  return id;
}

// An address that tells nothing of those of the rest of the process: addresses of the memory are in
// it, and others read them.
void* any_address() {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__) || UINTPTR_MAX == UINT32_MAX
  return nullptr;  // their tools, and small address spaces, expect memory at certain places
#else
  constexpr std::uint64_t kLow = std::uint64_t{1} << 40U;
  constexpr std::uint64_t kPages = std::uint64_t{1} << 33U;
  constexpr std::uint64_t kPage = 4096;
  // NOLINTNEXTLINE(*-reinterpret-cast,performance-no-int-to-ptr): a hint for the kernel
  return reinterpret_cast<void*>(kLow + random_number() % kPages * kPage);
#endif
}

std::shared_ptr<void> mapped(void* at, std::size_t size) {
  return {at, [size](void* memory) { munmap(memory, size); }};
}

class LinuxMemory final : public SharedMemory {
 public:
  LinuxMemory() = default;
  ~LinuxMemory() override {
    {
      const Lock lock(mutex_);
      stopping_ = true;
    }
    wake();
    if (thread_.joinable()) thread_.join();
    // Otherwise they would take it for a death.
    for (const Reader& reader : readers_) {
      if (reader.admitted) (void)send_welcome(reader.socket, {}, -1);
    }
  }

  Result<OwnMemory> create(std::size_t size) override;
  Result<MemoryOffer> offer(std::uint64_t layout, std::function<void(bool)> on_waiting) override;
  Result<MappedMemory> attach(const MemoryOffer& offer, std::uint64_t layout,
                              std::function<void(bool)> on_end) override;

 private:
  // A reader of the own memory.
  struct Reader {
    Descriptor socket;
    Clock::time_point since;
    bool admitted = false;
    bool waits = false;  // for what is written
  };
  // The owner of memory that is read here.
  struct Owner {
    Descriptor socket;
    std::function<void(bool)> on_end;
  };

  // Not through a shared pointer: what is attached may outlive this.
  struct Watched {
    Mutex mutex;
    std::map<std::uint64_t, Owner> owners TFDUDE_GUARDED_BY(mutex);
  };

  [[nodiscard]] Result<void> start() TFDUDE_REQUIRES(mutex_);
  void wake() const {
    const std::uint64_t one = 1;
    if (wake_.valid()) (void)!write(wake_.get(), &one, sizeof(one));
  }
  void run();
  /// The number of readers that have not said yet what they want.
  [[nodiscard]] std::ptrdiff_t heard_now() const {
    return std::count_if(readers_.begin(), readers_.end(),
                         [](const Reader& reader) { return !reader.admitted; });
  }
  void admit();
  void listen_to_readers(const std::vector<pollfd>& polled, std::size_t first);
  void end(std::uint64_t number);

  const std::string kernel_ = kernel_id();
  Mutex mutex_;
  std::thread thread_ TFDUDE_GUARDED_BY(mutex_);
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  Descriptor wake_;
  Descriptor memory_;
  std::optional<MemoryOffer> offer_;
  std::function<void(bool)> on_waiting_;
  Descriptor listening_ TFDUDE_GUARDED_BY(mutex_);
  std::uint64_t next_ TFDUDE_GUARDED_BY(mutex_) = 0;
  const std::shared_ptr<Watched> watched_ = std::make_shared<Watched>();
  // Of the thread.
  std::vector<Reader> readers_;
  bool any_waits_ = false;
  Clock::time_point admits_from_{};
};

Result<OwnMemory> LinuxMemory::create(std::size_t size) {
  rlimit limit{};
  // Beyond it the process would be sent a signal.
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < size) {
    return unsupported("the limit of file sizes (ulimit -f) is below the " +
                       std::to_string(size >> 20U) + " MiB that are reserved");
  }
  Descriptor fd(memfd_create("tfdude", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!fd.valid()) return refused_by_system("memfd_create");
  if (ftruncate(fd.get(), static_cast<off_t>(size)) != 0) return refused_by_system("ftruncate");
  void* at = mmap(any_address(), size, PROT_READ | PROT_WRITE, MAP_SHARED, fd.get(), 0);
  if (at == MAP_FAILED) return refused_by_system("mmap");
  OwnMemory own{mapped(at, size), size};
  // A child must not write to it.
  (void)madvise(at, size, MADV_DONTFORK);
  constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;
  if (fcntl(fd.get(), F_ADD_SEALS, kSeals) != 0) return refused_by_system("sealing");
  memory_ = std::move(fd);
  return own;
}

Result<void> LinuxMemory::start() {
  if (thread_.joinable()) return {};
  wake_ = Descriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake_.valid()) return refused_by_system("eventfd");
  try {
    thread_ = std::thread([this] {
      (void)pthread_setname_np(pthread_self(), "tfdude-memory");
      run();
    });
  } catch (const std::system_error& error) {
    return unsupported(std::string("no thread for it: ") + error.what());
  }
  return {};
}

Result<MemoryOffer> LinuxMemory::offer(std::uint64_t layout, std::function<void(bool)> on_waiting) {
  MemoryOffer offered{kernel_, random_name(), {random_number(), random_number() | 1U}, layout, 0,
                      {}};
  auto listening = listen_at(offered.socket);
  if (!listening) return tl::unexpected(std::move(listening.error()));
  const Lock lock(mutex_);
  offer_ = offered;
  on_waiting_ = std::move(on_waiting);
  listening_ = *std::move(listening);
  if (auto started = start(); !started) return tl::unexpected(std::move(started.error()));
  wake();
  return offered;
}

Result<MappedMemory> LinuxMemory::attach(const MemoryOffer& offer, std::uint64_t layout,
                                         std::function<void(bool)> on_end) {
  if (offer.socket.empty()) return unsupported(offer.why_not);
  if (offer.kernel != kernel_ || kernel_.empty()) return unsupported("it runs on another computer");
  if (offer.layout != layout) return unsupported("its memory has another layout: another build");
  auto socket = connect_to(offer.socket);
  if (!socket) return tl::unexpected(std::move(socket.error()));
  Welcome welcome;
  Descriptor fd;
  if (!send_hello(*socket, {Hello().magic, offer.token[0], layout})) {
    return refused_by_system("the handshake");
  }
  pollfd answer{socket->get(), POLLIN, 0};
  if (poll(&answer, 1, static_cast<int>(kAnswerIn.count())) != 1) {
    return fail(Errc::kTimeout, "it does not answer at its socket");
  }
  const bool received = receive_welcome(*socket, welcome, fd);
  if (!received || welcome.token != offer.token[1] || !fd.valid()) {
    return unsupported("it does not let this process read");
  }
  struct stat status {};
  const int seals = fcntl(fd.get(), F_GET_SEALS);
  const bool fixed = seals >= 0 && (seals & F_SEAL_SHRINK) != 0;
  if (!fixed || fstat(fd.get(), &status) != 0 || status.st_size <= 0 ||
      static_cast<std::uint64_t>(status.st_size) > kMostBytes) {
    return unsupported("its memory may shrink");
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  void* at = mmap(nullptr, size, PROT_READ, MAP_SHARED, fd.get(), 0);
  if (at == MAP_FAILED) return refused_by_system("mmap");
  (void)madvise(at, size, MADV_DONTDUMP);
  const std::shared_ptr<void> memory = mapped(at, size);

  std::uint64_t number = 0;
  {
    const Lock lock(mutex_);
    if (auto started = start(); !started) return tl::unexpected(std::move(started.error()));
    number = ++next_;
  }
  {
    const Lock lock(watched_->mutex);
    watched_->owners[number] = {*std::move(socket), std::move(on_end)};
  }
  wake();
  const auto tell_waiting = [number, watched = watched_](bool waits) {
    const Lock owners(watched->mutex);
    const auto found = watched->owners.find(number);
    Wish wish;
    wish.waits = waits ? 1 : 0;
    if (found != watched->owners.end()) (void)send_wish(found->second.socket, wish);
  };
  // The connection ends with the memory.
  return MappedMemory{{at,
                       [memory, number, watched = watched_](const void*) {
                         Owner ended;
                         const Lock owners(watched->mutex);
                         const auto found = watched->owners.find(number);
                         if (found == watched->owners.end()) return;
                         ended = std::move(found->second);
                         watched->owners.erase(found);
                         hang_up(ended.socket);
                       }},
                      size,
                      tell_waiting};
}

void LinuxMemory::run() {
  std::vector<pollfd> polled;
  std::vector<std::uint64_t> numbers;
  while (true) {
    const bool rests = Clock::now() < admits_from_;
    const std::ptrdiff_t heard = heard_now();
    polled.assign(1, {wake_.get(), POLLIN, 0});
    {
      const Lock lock(mutex_);
      if (stopping_) return;
      polled.push_back({rests || heard >= kMostHeard ? -1 : listening_.get(), POLLIN, 0});
    }
    for (const Reader& reader : readers_) polled.push_back({reader.socket.get(), POLLIN, 0});
    const std::size_t first_owner = polled.size();
    numbers.clear();
    {
      const Lock lock(watched_->mutex);
      for (const auto& [number, owner] : watched_->owners) {
        numbers.push_back(number);
        polled.push_back({owner.socket.get(), POLLIN, 0});
      }
    }
    const auto most = (rests ? kRest : kPatience).count();
    const int wait = heard > 0 || rests ? static_cast<int>(most) : -1;
    (void)poll(polled.data(), static_cast<nfds_t>(polled.size()), wait);
    std::uint64_t woken = 0;
    if (polled[0].revents != 0) (void)!read(wake_.get(), &woken, sizeof(woken));
    for (std::size_t i = first_owner; i < polled.size(); ++i) {
      if (polled[i].revents != 0) end(numbers[i - first_owner]);
    }
    listen_to_readers(polled, 2);
    if (polled[1].revents != 0) admit();
  }
}

// What an owner says after its welcome is that it ends.
void LinuxMemory::end(std::uint64_t number) {
  Owner ended;
  {
    const Lock lock(watched_->mutex);
    const auto found = watched_->owners.find(number);
    if (found == watched_->owners.end()) return;
    ended = std::move(found->second);
    watched_->owners.erase(found);
  }
  Welcome last;
  Descriptor none;
  ended.on_end(!receive_welcome(ended.socket, last, none));
}

void LinuxMemory::admit() {
  for (std::ptrdiff_t heard = heard_now(); heard < kMostHeard; ++heard) {
    const Lock lock(mutex_);
    Descriptor called = accept_one(listening_);
    if (!called.valid()) {
      // Without a free descriptor the caller would be reported again and again.
      if (errno != EAGAIN) admits_from_ = Clock::now() + kRest;
      return;
    }
    if (readers_.size() < kMostReaders) readers_.push_back({std::move(called), Clock::now()});
  }
}

// Whatever a reader says that was admitted, except what it wishes, is the end.
void LinuxMemory::listen_to_readers(const std::vector<pollfd>& polled, std::size_t first) {
  const Clock::time_point now = Clock::now();
  std::size_t i = first;
  const auto leaves = [&](Reader& reader) {
    const bool spoke = polled[i++].revents != 0;
    if (reader.admitted) {
      Wish wish;
      const bool ends = spoke && !receive_wish(reader.socket, wish);
      if (spoke) reader.waits = wish.waits != 0;
      return ends;
    }
    if (!spoke) return now - reader.since > kPatience;
    Hello hello;
    const bool may = receive_hello(reader.socket, hello) && hello.token == offer_->token[0] &&
                     hello.layout == offer_->layout;
    const Welcome welcome{may ? offer_->token[1] : 0};
    reader.admitted = send_welcome(reader.socket, welcome, may ? memory_.get() : -1) && may;
    return !reader.admitted;
  };
  std::vector<Reader> stay;
  for (Reader& reader : readers_) {
    if (!leaves(reader)) stay.push_back(std::move(reader));
  }
  readers_ = std::move(stay);
  const bool any_waits = std::any_of(readers_.begin(), readers_.end(),
                                     [](const Reader& reader) { return reader.waits; });
  if (std::exchange(any_waits_, any_waits) != any_waits && on_waiting_) on_waiting_(any_waits);
}

}  // namespace

std::unique_ptr<SharedMemory> make_linux_memory() { return std::make_unique<LinuxMemory>(); }

}  // namespace tfdude
