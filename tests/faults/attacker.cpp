#include "faults/attacker.hpp"

#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <utility>

#include "tfdude/transport/fastdds.hpp"

#include "support/deaf_handler.hpp"
#include "support/stranger.hpp"
#include "transport/port.hpp"

namespace tfdude::faults {
namespace {

/// A participant that sends as fast as it can, and does not listen.
class Flood {
 public:
  explicit Flood(TransportPtr transport) : transport_(std::move(transport)) {}

  [[nodiscard]] Result<void> start() { return transport_->start(deaf_); }

  void ask(const std::string& partition, const std::string& id, decltype(Request::body) body) {
    Request request;
    request.sequence = ++sequence_;
    request.id = id;
    request.body = std::move(body);
    (void)transport_->send(partition, request, soon());
  }
  void stream(const std::string& partition, const Update& update) {
    (void)transport_->send(partition, update, soon());
  }
  [[nodiscard]] Transport& transport() { return *transport_; }
  [[nodiscard]] std::uint32_t next() { return ++count_; }

 private:
  [[nodiscard]] static Transport::Deadline soon() {
    return std::chrono::steady_clock::now() + std::chrono::seconds(10);
  }

  testing::DeafHandler deaf_;
  TransportPtr transport_;
  std::uint32_t sequence_ = 0;
  std::uint32_t count_ = 0;
};

void look(Flood& flood) { flood.ask("arm", "hand", LookupRequest{{{"arm", "hand"}}}); }

void look_far(Flood& flood) {
  LookupRequest lookup;
  lookup.segments.assign(kMaxItems, {"arm", "hand"});
  flood.ask("arm", "hand", std::move(lookup));
}

void ask_trees(Flood& flood) {
  FramesRequest request;
  request.trees.assign(64, std::string(1, kAnyName));
  flood.ask("base", "base", std::move(request));
}

void watch(Flood& flood) {
  WatchRequest request;
  request.segments = {{"arm", "hand"}};
  request.period = std::chrono::nanoseconds(flood.next());
  flood.ask("arm", "hand", std::move(request));
}

void change(Flood& flood) {
  const std::string id = "evil" + std::to_string(flood.next());
  flood.ask("arm", id, AddRequest{"hand", {}, 0});
  if (flood.next() % 4 == 0) flood.ask("arm", id, RemoveRequest{{id}, 0});
}

void stream(Flood& flood) {
  Update update;
  for (std::size_t i = 0; i < 1000; ++i) {
    update.edges.push_back({"evil" + std::to_string(i), {}});
  }
  flood.stream("arm", update);
}

Presence presence_of_evil(Flood& flood) {
  Presence presence;
  presence.partition = "evil";
  presence.incarnation = flood.next();
  presence.host = "evil";
  presence.pages = 1'000'000;
  presence.serving = true;
  return presence;
}

void announce(Flood& flood) {
  Presence presence = presence_of_evil(flood);
  for (std::size_t i = 0; i < 256; ++i) {
    presence.absent.push_back({"evil" + std::to_string(flood.next()), 0, Absent::Kind::kLost, 1});
  }
  flood.transport().announce(presence);
}

void publish(Flood& flood) {
  const std::uint32_t number = flood.next();
  if (number == 1) flood.transport().announce(presence_of_evil(flood));
  Page page{"evil", number, 2, 3, {}};
  for (std::size_t i = 0; i < 64; ++i) {
    page.entries.push_back({"evil" + std::to_string(number) + "_" + std::to_string(i), "hand", 1});
  }
  flood.transport().publish(page);
}

using Step = std::function<void(Flood&)>;

const std::map<std::string, Step>& steps() {
  static const std::map<std::string, Step> all{{"lookups", look},    {"long_lookups", look_far},
                                               {"trees", ask_trees}, {"watches", watch},
                                               {"changes", change},  {"streams", stream},
                                               {"pages", publish},   {"presences", announce}};
  return all;
}

void begin() {
  std::puts("ready");
  std::fflush(stdout);
}

[[noreturn]] void burn() {
  begin();
  std::atomic<std::uint64_t> count{0};
  while (true) ++count;
}

[[noreturn]] void send_datagrams(std::uint32_t domain) {
  testing::Stranger stranger(domain);
  const auto participants = stranger.await_participants(2);
  begin();
  while (true) testing::send_huge_ranges(stranger, {participants.begin(), participants.end()});
}

}  // namespace

const std::vector<std::string>& attacks() {
  // The first only uses processor time, as all others do, too.
  static const std::vector<std::string> all = [] {
    std::vector<std::string> kinds{"burn", "datagrams"};
    for (const auto& [kind, step] : steps()) kinds.push_back(kind);
    return kinds;
  }();
  return all;
}

int attack(const std::string& kind, std::uint32_t domain, const std::string& keys) {
  if (kind == "burn") burn();
  if (kind == "datagrams") send_datagrams(domain);
  const bool owns = kind == "pages" || kind == "presences";
  auto transport =
      make_fastdds_transport({domain, TFDUDE_LOOPBACK_PROFILE, owns ? "evil" : "", {}, {}, keys});
  if (!transport) {
    std::fprintf(stderr, "%s\n", transport.error().message.c_str());
    return 1;
  }
  Flood flood(*std::move(transport));
  if (auto started = flood.start(); !started) {
    std::fprintf(stderr, "%s\n", started.error().message.c_str());
    return 1;
  }
  const Step& step = steps().at(kind);
  begin();
  while (true) step(flood);
}

}  // namespace tfdude::faults
