#include "sending.hpp"

#include <chrono>

#include "../rendering/format.hpp"
#include "answer.hpp"
#include "known_joints.hpp"
#include "lines.hpp"
#include "options.hpp"
#include "samples.hpp"

namespace tfdude::cli {
namespace {

constexpr std::size_t kToldErrors = 10;

// What was sent, for the words at the end.
struct Sent {
  std::size_t lines = 0;
  std::size_t values = 0;
  std::size_t rejected = 0;
  std::size_t outside = 0;  // positions of joints outside their limits
  double seconds = 0;

  [[nodiscard]] double rate() const {
    return seconds > 0 ? static_cast<double>(lines) / seconds : 0.0;
  }
};

std::string describe(const Sent& sent) {
  std::string text = format("sent         %zu lines with %zu values in %.3f s, %.1f lines/s\n",
                            sent.lines, sent.values, sent.seconds, sent.rate());
  if (sent.rejected > 0) text += format("rejected     %zu lines\n", sent.rejected);
  if (sent.outside > 0)
    text += format("outside      %zu positions, of their limits\n", sent.outside);
  return text;
}

Result<void> send_one(Client& client, const Sample& sample, bool acknowledged) {
  if (acknowledged) {
    if (!sample.edges.empty()) return fail(Errc::kInvalidInput, "an edge is not a joint");
    return client.update_joints(sample.joints, sample.stamp);
  }
  if (!sample.edges.empty()) {
    if (auto sent = client.publish(sample.edges, sample.stamp); !sent) return sent;
  }
  return sample.joints.empty() ? Result<void>()
                               : client.publish_joints(sample.joints, sample.stamp);
}

void tell(const Lines& lines, const std::string& error) {
  std::fprintf(stderr, "tfdude: line %zu: %s\n", lines.number(), error.c_str());
}

// Tells the first errors; a controller's pipe may repeat one a thousand times per second.
void reject(Sent& sent, const Lines& lines, const Error& error) {
  if (++sent.rejected > kToldErrors) return;
  tell(lines, error.message);
  if (sent.rejected == kToldErrors) std::fputs("tfdude: further errors are only counted\n", stderr);
}

// Lines that come faster than a controller's, as those of a file, would overwrite each other on
// their way (Client::flush): so after each few of them it waits until they have arrived.
class Bursts {
 public:
  explicit Bursts(Client& client, Milliseconds timeout) : client_(client), timeout_(timeout) {}

  [[nodiscard]] Result<void> sent_one() {
    constexpr int kFew = 32;
    constexpr std::chrono::milliseconds kTime{16};  // at 2 kHz
    if (++lines_ < kFew) return {};
    const bool fast = std::chrono::steady_clock::now() - begin_ < kTime;
    const auto arrived = fast ? client_.flush(timeout_) : Result<void>();
    lines_ = 0;
    begin_ = std::chrono::steady_clock::now();
    return arrived;
  }

 private:
  Client& client_;
  Milliseconds timeout_;
  int lines_ = 0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

void count(Sent& sent, const Sample& sample, const std::map<std::string, JointInfo>& known) {
  ++sent.lines;
  sent.values += sample.edges.size() + sample.joints.size();
  for (const JointValue& value : sample.joints) {
    const auto joint = known.find(value.name);
    const bool limited = joint != known.end() && joint->second.limits.has_value();
    if (limited && !joint->second.limits->contain(value.position)) ++sent.outside;
  }
}

}  // namespace

void SampleLines::add_rate(CLI::App& app, CLI::Option* input) {
  app.add_option("--rate", rate, "lines per second; default: as they come")
      ->type_name("HZ")
      ->check(within(0.001, 1e5, "0.001 to 100000"))
      ->needs(input);
}

int SampleLines::send(Client& client, const Common& common, bool acknowledged) const {
  auto lines = Lines::open(file, rate);
  if (!lines) return report(lines.error(), common);
  const auto known = known_joints(client);
  SampleReader reader(common.angles, known);
  Sent sent;
  Bursts bursts(client, common.options.timeout);
  const auto start = std::chrono::steady_clock::now();
  while (const auto line = lines->next()) {
    const auto sample = reader.read(*line);
    if (sample && !*sample) continue;
    const auto done =
        sample
            ? send_one(client, **sample, acknowledged).and_then([&] { return bursts.sent_one(); })
            : Result<void>(tl::unexpected(sample.error()));
    if (done) {
      count(sent, **sample, known);
    } else {
      reject(sent, *lines, done.error());
    }
  }
  if (!lines->failure().empty()) {
    ++sent.rejected;
    tell(*lines, lines->failure());
  } else if (!lines->interrupted()) {
    if (const auto ended = reader.finish(); !ended) reject(sent, *lines, ended.error());
  }
  const auto flushed = client.flush(common.options.timeout);
  sent.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  (void)answer(common,
               {{"lines", sent.lines},
                {"values", sent.values},
                {"rejected", sent.rejected},
                {"outside", sent.outside},
                {"seconds", sent.seconds},
                {"rate", sent.rate()}},
               describe(sent));
  if (!flushed) return report(flushed.error(), common);
  return sent.rejected == 0 ? kDone : kRejected;
}

}  // namespace tfdude::cli
