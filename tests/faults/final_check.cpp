#include "faults/final_check.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <nlohmann/json.hpp>

#include "support/process.hpp"

namespace tfdude::faults {
namespace {

using Frames = std::map<std::string, Frame>;
using Workers = std::vector<std::unique_ptr<Worker>>;

Frames frames_of(Client& client) {
  Frames frames;
  auto all = client.frames();
  if (!all) return frames;
  for (Frame& frame : *all) frames.emplace(frame.id, std::move(frame));
  return frames;
}

Frames frames_by_cli(const Cluster& cluster) {
  const auto run = cluster.cli({"--json", "frames"});
  Frames frames;
  const auto answer = nlohmann::json::parse(run.out, nullptr, false);
  if (run.status != 0 || answer.is_discarded()) return frames;
  for (const auto& one : answer["frames"]) {
    const auto parent = one["parent"];
    Frame frame{one["id"], parent.is_null() ? std::string() : parent.get<std::string>(),
                one["partition"], one["attached"]};
    frames.emplace(frame.id, frame);
  }
  return frames;
}

const Frame* find(const Frames& frames, const std::string& id) {
  const auto found = frames.find(id);
  return found != frames.end() ? &found->second : nullptr;
}

std::string describe(const Frames& frames, const std::string& id) {
  return faults::describe(find(frames, id));
}

// Empty if both are equal; otherwise the first frame that differs.
std::string difference(const Frames& a, const Frames& b) {
  std::set<std::string> ids;
  for (const auto* frames : {&a, &b}) {
    for (const auto& [id, frame] : *frames) ids.insert(id);
  }
  for (const std::string& id : ids) {
    const std::string in_a = describe(a, id);
    const std::string in_b = describe(b, id);
    if (in_a != in_b) return id + ": " + in_a + ", or " + in_b;
  }
  return "";
}

struct Misplaced {
  std::string what;
  std::vector<std::string> history;
};

std::vector<Misplaced> all_misplaced(const Frames& frames, const Workers& workers) {
  std::vector<Misplaced> all;
  for (const auto& worker : workers) {
    for (const auto* models : {&worker->model().frames(), &worker->model().removed()}) {
      for (const auto& [id, model] : *models) {
        const std::string what = misplaced(id, model, find(frames, id));
        if (!what.empty()) all.push_back({what, model.history});
      }
    }
    for (const auto& [id, base] : worker->joints()) {
      const auto found = frames.find(id);
      if (found == frames.end() || found->second.parent != base) {
        all.push_back({id + " is " + describe(frames, id), {}});
      }
    }
  }
  return all;
}

// Their edges, as two clients see them.
void check_values(const std::string& when, std::vector<Client>& clients, const Workers& workers,
                  Journal& journal) {
  const bool quiet = journal.calm() > kGrace;
  std::size_t looked_up = 0;
  for (Client& client : clients) {
    const Frames frames = frames_of(client);
    for (const auto& worker : workers) {
      for (const auto& [id, model] : std::map(worker->model().frames())) {
        const auto found = frames.find(id);
        if (found == frames.end() || !found->second.attached) continue;
        const std::string& parent = found->second.parent;
        const auto X_PC = client.lookup(parent, id);
        ++looked_up;
        const std::string wrong = X_PC ? worker->model().judge(parent, id, X_PC->transform(), quiet)
                                       : X_PC.error().message;
        if (!wrong.empty()) journal.violation(when + ": " + wrong, model.history);
      }
      for (const auto& [id, base] : worker->joints()) {
        const auto X_BJ = client.lookup(base, id);
        const std::string wrong = X_BJ ? worker->judge_joint(id, *X_BJ) : X_BJ.error().message;
        if (!wrong.empty()) journal.violation(when + ": " + wrong);
      }
    }
  }
  std::printf("%s: %zu values looked up\n", when.c_str(), looked_up);
}

// Frames that no model knows must be the same for all clients.
void check_contested(const std::string& when, std::vector<Client>& clients, Journal& journal) {
  for (std::size_t i = 0; i < kContested; ++i) {
    const std::string id = contested_frame(i);
    const auto one = clients[0].lookup("world", id);
    const auto other = clients[1].lookup("world", id);
    const bool same = one && other ? one->pose.matrix() == other->pose.matrix()
                                   : outcome_of(one) == outcome_of(other);
    journal.count("contested at the end", outcome_of(one));
    if (!same) {
      journal.violation(when + ": two clients see " + id + " differently: " + outcome_of(one) +
                        ", " + outcome_of(other));
    }
  }
}

}  // namespace

void check_all(const std::string& when, Cluster& cluster, Client& observer, const Workers& workers,
               Journal& journal) {
  const double begin = journal.now();
  std::vector<Client> fresh;
  for (int i = 0; i < 2; ++i) fresh.push_back(cluster.open_observer(Milliseconds(5000)));
  std::vector<std::pair<std::string, Client*>> clients;
  for (Client& client : fresh) clients.emplace_back("a new client", &client);
  clients.emplace_back("the observer", &observer);
  for (std::size_t i = 0; i < workers.size(); ++i) {
    clients.emplace_back("client " + std::to_string(i), &workers[i]->client());
  }
  std::string differs;
  Frames frames;
  const bool agree = testing::eventually([&] {
    differs.clear();
    frames = frames_of(fresh[0]);
    const auto partitions = fresh[0].partitions();
    if (!partitions) differs += partitions.error().message + "\n";
    for (const PartitionInfo& partition : partitions.value_or(std::vector<PartitionInfo>())) {
      if (!partition.reachable) differs += partition.name + " is not reachable\n";
    }
    for (auto& [name, client] : clients) {
      const std::string here = difference(frames, frames_of(*client));
      if (!here.empty()) differs += name + " differs from a new one: " + here + "\n";
    }
    return differs.empty() && all_misplaced(frames, workers).empty();
  });
  if (!differs.empty()) journal.violation(when + ": " + differs);
  for (const auto& one : all_misplaced(frames, workers)) {
    journal.violation(when + ": " + one.what, one.history);
  }
  if (agree) {
    std::printf("%s: %zu clients agree on %zu frames after %.3f s\n", when.c_str(), clients.size(),
                frames.size(), journal.now() - begin);
  }
  // An owner that has just learned of a removal may still remove what was below.
  std::string by_cli;
  const bool same = testing::eventually([&] {
    by_cli = difference(frames_of(fresh[0]), frames_by_cli(cluster));
    return by_cli.empty();
  });
  if (!same) journal.violation(when + ": the command line differs: " + by_cli);
  check_values(when, fresh, workers, journal);
  check_contested(when, fresh, journal);
}

}  // namespace tfdude::faults
