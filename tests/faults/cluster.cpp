#include "faults/cluster.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sched.h>
#include <sstream>
#include <stdexcept>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include "faults/worker.hpp"

namespace tfdude::faults {
namespace {

using testing::in_time;
using testing::Process;

constexpr std::size_t kLogShown = 3000;

// Drops packets from some hosts, or packets that pass some interfaces.
constexpr const char* kFirewall = R"(nft -f - <<END
table ip parted {
  set others { type ipv4_addr; }
  set links { type ifname; }
  chain arriving {
    type filter hook prerouting priority raw;
    ip saddr @others drop
    iifname @links drop
  }
  chain leaving {
    type filter hook output priority raw;
    oifname @links drop
  }
}
END
)";

// Debian's faketime, which lets a process see another wall clock, and change it by a file.
constexpr const char* kFakeTime = TFDUDE_FAKETIME;

// Just enough room for the state of all daemons.
constexpr const char* kDiskSize = "size=64m";

std::string config_of(std::size_t partition) {
  const Eigen::Vector3d t = base_edge(partition).pose.translation();
  std::ostringstream yaml;
  yaml << "partition: " << partition_name(partition) << "\nframes:\n";
  if (partition == 0) yaml << "  - id: world\n";
  yaml << "  - id: " << base_of(partition) << "\n    parent: world\n    xyz: [" << t.x() << ", "
       << t.y() << ", " << t.z() << "]\n";
  return yaml.str();
}

}  // namespace

Cluster::Cluster(std::size_t partitions, std::size_t clients,
                 std::vector<std::string> daemon_options)
    : daemon_options_(std::move(daemon_options)),
      no_links_(testing::Hosts::missing()),
      clocks_(access(kFakeTime, R_OK) == 0),
      variants_(partitions, Variant::kUsual),
      daemons_(partitions) {
  mkdir(state_directory().c_str(), S_IRWXU);
  // Visible to this thread and to the processes that it starts.
  disk_ = unshare(CLONE_NEWNS) == 0 &&
          mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
          mount("none", state_directory().c_str(), "tmpfs", 0, kDiskSize) == 0;
  if (!disk_) no_disk_ = std::string("none can be mounted: ") + std::strerror(errno);
  if (no_links_.empty()) {
    hosts_.emplace(1 + partitions + clients);
    hosts_->enter(kObservers);
    for (std::size_t host = 0; host < hosts_->count(); ++host) {
      shell(host, kFirewall);
    }
  } else {
    domain_.emplace();
  }
  for (std::size_t i = 0; i < partitions; ++i) {
    (void)directory_.write(partition_name(i) + ".yaml", config_of(i));
    (void)directory_.write(partition_name(i) + "-spare.yaml",
                           config_of(i) + "  - id: spare_" + std::to_string(i) +
                               "\n    parent: " + base_of(i) + "\n    xyz: [0, 0, 1]\n");
    step_clock(i, 0);
  }
}

Cluster::~Cluster() {
  daemons_.clear();
  if (disk_) (void)umount2(state_directory().c_str(), MNT_DETACH);
}

void Cluster::step_clock(std::size_t partition, int seconds) const {
  (void)directory_.write(partition_name(partition) + ".clock",
                         (seconds < 0 ? "" : "+") + std::to_string(seconds) + "\n");
}

void Cluster::fill_disk() const {
  std::ofstream filler(state_directory() + "/filler", std::ios::binary);
  const std::string block(4096, 'x');
  while (filler.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
  }
}

void Cluster::clear_disk() const { (void)unlink((state_directory() + "/filler").c_str()); }

std::vector<std::string> Cluster::meeting() const {
  if (!domain_) return {};
  return {"--domain", std::to_string(domain_->number()), "--profile", TFDUDE_LOOPBACK_PROFILE};
}

Client Cluster::open_on(std::size_t host, Milliseconds timeout) const {
  Options options;
  options.timeout = timeout;
  if (domain_) {
    options.domain = domain_->number();
    options.profile = TFDUDE_LOOPBACK_PROFILE;
  }
  const auto open = [&] { return *Client::open(options); };
  return hosts_ ? hosts_->on(host, open) : open();
}

testing::CliResult Cluster::cli(const std::vector<std::string>& arguments) const {
  std::vector<std::string> command{TFDUDE_CLI};
  for (const auto& part : {meeting(), arguments}) {
    command.insert(command.end(), part.begin(), part.end());
  }
  Process process = hosts_ ? hosts_->start(kObservers, command) : Process(command);
  return testing::finish(process);
}

std::string Cluster::log_file(std::size_t partition) const {
  return directory_.path() + "/" + partition_name(partition) + ".log";
}

std::vector<std::string> Cluster::configuration(std::size_t partition) const {
  const std::string name = partition_name(partition);
  switch (variants_[partition]) {
    case Variant::kNone:
      return {"--partition", name};
    case Variant::kWithSpare:
      return {"--config", directory_.path() + "/" + name + "-spare.yaml"};
    case Variant::kUsual:
      break;
  }
  return {"--config", directory_.path() + "/" + name + ".yaml"};
}

std::string Cluster::clock_file(std::size_t partition) const {
  return directory_.path() + "/" + partition_name(partition) + ".clock";
}

void Cluster::start(std::size_t partition) {
  // Its log goes into a file, because nobody may read a pipe in time.
  std::string script = "exec 2>>" + log_file(partition) + "; ";
  if (clocks_) {
    script += std::string("export FAKETIME_DONT_FAKE_MONOTONIC=1 FAKETIME_CACHE_DURATION=1") +
              " FAKETIME_TIMESTAMP_FILE=" + clock_file(partition) + " LD_PRELOAD=" + kFakeTime +
              "; ";
  }
  std::vector<std::string> command{"/bin/sh",     "-c",      script + "exec \"$0\" \"$@\"",
                                   TFDUDE_DAEMON, "--state", state_directory()};
  for (const auto& part : {configuration(partition), meeting(), daemon_options_}) {
    command.insert(command.end(), part.begin(), part.end());
  }
  daemons_[partition].reset();
  if (hosts_) {
    daemons_[partition].emplace(hosts_->start(daemon_host(partition), command));
  } else {
    daemons_[partition].emplace(command);
  }
}

void Cluster::kill(std::size_t partition) {
  if (!daemons_[partition]) return;
  daemons_[partition]->kill();
  daemons_[partition].reset();
}

void Cluster::pause(std::size_t partition) {
  if (daemons_[partition]) daemons_[partition]->freeze();
}

void Cluster::resume(std::size_t partition) {
  if (daemons_[partition]) daemons_[partition]->signal(SIGCONT);
}

bool Cluster::ready(std::size_t partition) {
  return daemons_[partition] && daemons_[partition]->wait_for_line("ready ", Clock::now());
}

void Cluster::await_ready(std::size_t partition) {
  if (daemons_[partition]->wait_for_line("ready ", in_time())) return;
  throw std::runtime_error(partition_name(partition) + " does not get ready:\n" +
                           log_of(partition));
}

std::vector<std::string> Cluster::take_ended() {
  std::vector<std::string> ended;
  for (std::size_t i = 0; i < daemons_.size(); ++i) {
    if (!daemons_[i] || daemons_[i]->runs()) continue;
    const auto status = daemons_[i]->wait(Clock::now());
    ended.push_back(partition_name(i) + " (status " + std::to_string(status.value_or(-1)) +
                    "), its log ends with\n" + log_of(i));
    daemons_[i].reset();
  }
  return ended;
}

std::string Cluster::log_of(std::size_t partition) const {
  std::ifstream file(log_file(partition));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return text.size() <= kLogShown ? text : text.substr(text.size() - kLogShown);
}

void Cluster::shell(std::size_t host, const std::string& script) const {
  Process process =
      hosts_->start(host, {"/bin/sh", "-c", "PATH=/usr/sbin:/sbin:$PATH; set -e\n" + script});
  if (process.wait(in_time()) != 0) throw std::runtime_error("failed: " + process.err());
}

void Cluster::cut(std::size_t host) const {
  shell(host, "nft add element ip parted links { eth0 }");
}

void Cluster::heal(std::size_t host) const {
  shell(host, "nft delete element ip parted links { eth0 }");
}

void Cluster::part(std::size_t host, std::size_t other) const {
  shell(host, "nft add element ip parted others '{ " + testing::Hosts::address(other) + " }'");
  shell(other, "nft add element ip parted others '{ " + testing::Hosts::address(host) + " }'");
}

void Cluster::join(std::size_t host, std::size_t other) const {
  shell(host, "nft delete element ip parted others '{ " + testing::Hosts::address(other) + " }'");
  shell(other, "nft delete element ip parted others '{ " + testing::Hosts::address(host) + " }'");
}

}  // namespace tfdude::faults
