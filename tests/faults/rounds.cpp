#include "faults/rounds.hpp"

#include <cstdio>
#include <filesystem>
#include <set>
#include <sstream>

#include "faults/cluster.hpp"
#include "faults/journal.hpp"
#include "faults/worker.hpp"
#include "support/process.hpp"

namespace tfdude::faults {
namespace {

using testing::eventually;

std::set<std::string> files_in(const std::string& directory) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (!entry.is_directory()) names.insert(entry.path().filename().string());
  }
  return names;
}

std::string list(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += " " + name;
  return text;
}

// Other programs on this computer may use shared memory as they like, so the directory says
// nothing. faketime has its own there.
std::set<std::string> shared_memory_of(pid_t process) {
  std::set<std::string> names;
  std::istringstream maps(testing::maps_of(process));
  for (std::string line; std::getline(maps, line);) {
    const auto at = line.find("/dev/shm/");
    if (at != std::string::npos && line.find("faketime_", at) == std::string::npos) {
      names.insert(line.substr(at));
    }
  }
  return names;
}

// The database, and the files that SQLite keeps next to it while it is open.
bool one_database(const std::set<std::string>& names) {
  std::set<std::string> databases;
  for (const std::string& name : names) {
    databases.insert(name.substr(0, name.find("-wal")).substr(0, name.find("-shm")));
  }
  return databases.size() == 1;
}

}  // namespace

int run_rounds(std::size_t rounds) {
  Cluster cluster(1, 0, {});
  Journal journal;
  cluster.start(0);
  cluster.await_ready(0);
  Client client = cluster.open_observer(Milliseconds(500));
  std::vector<double> until_answer;
  for (std::size_t round = 0; round < rounds; ++round) {
    const std::string id = "frame_" + std::to_string(round);
    if (!eventually([&] { return client.add(id, base_of(0), base_edge(0)).has_value(); })) {
      journal.violation(id + " cannot be added");
    }
    const auto shared = shared_memory_of(cluster.pid(0));
    if (!shared.empty()) journal.violation("a daemon uses shared memory:" + list(shared));
    cluster.kill(0);
    const auto begin = Clock::now();
    cluster.start(0);
    if (!eventually([&] { return client.lookup("world", id).has_value(); })) {
      journal.violation("round " + std::to_string(round) + ": no answer:\n" + cluster.log_of(0));
      break;
    }
    until_answer.push_back(milliseconds_since(begin));
    const auto state = files_in(cluster.state_directory());
    if (!one_database(state)) journal.violation("more files are kept:" + list(state));
  }
  cluster.await_ready(0);
  for (std::size_t round = 0; round < until_answer.size(); ++round) {
    const std::string id = "frame_" + std::to_string(round);
    if (!client.lookup("world", id)) journal.violation(id + " is missing");
  }
  std::printf("%zu rounds: from a daemon's start until it answers %s\n", rounds,
              distribution(until_answer).c_str());
  std::printf("state:%s\n", list(files_in(cluster.state_directory())).c_str());
  return journal.violations() == 0 ? 0 : 1;
}

}  // namespace tfdude::faults
