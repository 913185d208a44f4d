#include <set>
#include <string>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/keys/key_files.hpp"
#include "tfdude/keys/key_store.hpp"

#include "../../rendering/json.hpp"
#include "../commands.hpp"

namespace tfdude::cli {
namespace {

using nlohmann::json;

std::string protection_of(const KeySettings& settings) {
  return std::string("messages are ") + (settings.encrypt ? "encrypted" : "signed, not encrypted") +
         "; domains " + std::to_string(settings.domains.first) + " to " +
         std::to_string(settings.domains.last);
}

json identity_json(const KeyFiles& files) {
  const Roles& roles = files.roles;
  return {{"identity", files.identity},
          {"until", to_string(files.until)},
          {"encrypt", files.settings.encrypt},
          {"domains", {files.settings.domains.first, files.settings.domains.last}},
          {"serves", or_null(roles.serves)},
          {"look", roles.look},
          {"move", roles.move},
          {"stream", roles.stream},
          {"observe", roles.observe},
          {"publish_clock", roles.clock},
          {"error", nullptr}};
}

std::string identity_text(const KeyFiles& files) {
  std::string text = files.identity + ", valid until " + to_string(files.until) + "\n";
  for (const std::string& words : in_words(files.roles)) text += "  " + words + "\n";
  return text;
}

// What was done to an identity, and what it may do now.
int answer_done(const Common& common, const char* done, const Result<KeyFiles>& files) {
  if (!files) return report(files.error(), common);
  json object = identity_json(*files);
  object["done"] = done;
  return answer(common, object, std::string(done) + " " + identity_text(*files));
}

void add_lifetime(CLI::App& app, Days& lifetime, const char* help) {
  app.add_option_function<int>(
         "--days", [&lifetime](int days) { lifetime = Days(days); }, help)
      ->check(CLI::Range(1, kMaxLifetime.count()));
}

void add_partitions(CLI::App& app, const char* name, std::set<std::string>& partitions,
                    const char* help) {
  app.add_option_function<std::vector<std::string>>(
         name,
         [&partitions](const std::vector<std::string>& names) {
           partitions.insert(names.begin(), names.end());
         },
         help)
      ->type_name("NAME")
      ->allow_extra_args(false)
      // CLI11 takes whatever follows, also the next option.
      ->check([](const std::string& text) {
        return text.rfind("--", 0) == 0 ? quote(text) + " is an option, not a partition" : "";
      });
}

void add_roles(CLI::App& app, Roles& roles) {
  app.add_flag("--look", roles.look,
               "may ask for poses, joints and paths; --move and --observe include it");
  add_partitions(app, "--move", roles.move, "a partition that it may change in any way; repeat");
  add_partitions(app, "--stream", roles.stream,
                 "a partition to which it may stream values and joints; repeat");
  app.add_flag("--observe", roles.observe,
               "may send observations, and all other changes, to all partitions");
  app.add_flag("--publish-clock", roles.clock, "may publish the time of external clocks");
}

// A command about a key store. It needs no participant.
struct KeysCommand : Command {
  explicit KeysCommand(CLI::App& app) {
    app.add_option("DIR", directory, "the key store")->required();
  }

  std::string directory;
};

struct Init final : KeysCommand {
  explicit Init(CLI::App& app) : KeysCommand(app) {
    app.add_flag("--sign", sign, "messages are signed only, so anybody can read them");
    app.add_option("--domains", domains, "the DDS domains; default: 0 232")
        ->type_name("FIRST LAST")
        ->expected(2)
        ->check(CLI::Range(0, 232));
    add_lifetime(app, lifetime, "how long the authority is valid; default: 3650");
  }

  int run(const Common& common) const override {
    const KeySettings settings{!sign, {domains[0], domains[1]}};
    const Time now = wall_clock();
    const auto created = create_key_store(directory, settings, lifetime, now);
    if (!created) return report(created.error(), common);
    const auto info = read_key_store(directory, now);
    if (!info) return report(info.error(), common);
    const std::string until = to_string(info->until);
    return answer(common, {{"done", "created"}, {"authority", info->authority}, {"until", until}},
                  "created '" + info->authority + "', valid until " + until + "; " +
                      protection_of(settings) + "\n");
  }

  bool sign = false;
  std::vector<std::uint32_t> domains{0, 232};
  Days lifetime = kAuthorityLifetime;
};

struct DaemonKeys final : KeysCommand {
  explicit DaemonKeys(CLI::App& app) : KeysCommand(app) {
    app.add_option("PARTITION", partition, "the partition that it serves")->required();
    app.add_option("--name", name, "the identity, if not named like the partition");
    add_lifetime(app, lifetime, "how long they are valid; default: 365");
    add_roles(app, roles);
  }

  int run(const Common& common) const override {
    Roles all = roles;
    all.serves = partition;
    const std::string& identity = name.empty() ? partition : name;
    return answer_done(common, "created",
                       add_identity(directory, identity, all, lifetime, wall_clock()));
  }

  std::string partition;
  std::string name;
  Days lifetime = kIdentityLifetime;
  Roles roles;
};

struct ClientKeys final : KeysCommand {
  explicit ClientKeys(CLI::App& app) : KeysCommand(app) {
    app.add_option("NAME", name, "the identity")->required();
    add_lifetime(app, lifetime, "how long they are valid; default: 365");
    add_roles(app, roles);
  }

  int run(const Common& common) const override {
    return answer_done(common, "created",
                       add_identity(directory, name, roles, lifetime, wall_clock()));
  }

  std::string name;
  Days lifetime = kIdentityLifetime;
  Roles roles;
};

struct Renew final : KeysCommand {
  explicit Renew(CLI::App& app) : KeysCommand(app) {
    app.add_option("NAME", name, "the identity; default: all");
    add_lifetime(app, lifetime, "how long they are valid; default: 365");
  }

  // One identity, or all of them until one fails.
  int run(const Common& common) const override {
    const Time now = wall_clock();
    std::vector<std::string> names{name};
    if (name.empty()) {
      const auto info = read_key_store(directory, now);
      if (!info) return report(info.error(), common);
      names = info->identities;
    }
    for (const std::string& one : names) {
      const int status =
          answer_done(common, "renewed", renew_identity(directory, one, lifetime, now));
      if (status != kDone) return status;
    }
    return kDone;
  }

  std::string name;
  Days lifetime = kIdentityLifetime;
};

struct Revoke final : KeysCommand {
  explicit Revoke(CLI::App& app) : KeysCommand(app) {
    app.add_option("NAME", name, "the identity")->required();
  }

  int run(const Common& common) const override {
    const auto revoked = revoke_identity(directory, name, wall_clock());
    if (!revoked) return report(revoked.error(), common);
    return answer(common, {{"done", "revoked"}, {"identity", name}},
                  "revoked " + name +
                      "; to make it known, copy revoked.pem of each identity to its host, and "
                      "restart what uses it\n");
  }

  std::string name;
};

struct Check final : KeysCommand {
  explicit Check(CLI::App& app) : KeysCommand(app) {}

  int run(const Common& common) const override {
    const Time now = wall_clock();
    std::vector<std::string> identities{directory};
    json object;
    std::string text;
    std::string end;
    if (is_key_store(directory)) {
      const auto info = read_key_store(directory, now);
      if (!info) return report(info.error(), common);
      object = {{"authority", info->authority},
                {"until", to_string(info->until)},
                {"revoked", info->revoked}};
      text = info->authority + ", valid until " + to_string(info->until) + "\n  " +
             protection_of(info->settings) + "\n";
      for (const std::string& name : info->revoked) end += "revoked: " + name + "\n";
      identities = info->identities;
      for (std::string& name : identities) name.insert(0, directory + "/");
    }
    int status = kDone;
    object["identities"] = json::array();
    for (const std::string& path : identities) {
      const auto files = find_keys(path, now);
      if (!files) status = kRejected;
      object["identities"].push_back(files ? identity_json(*files)
                                           : json({{"error", files.error().message}}));
      text += files ? identity_text(*files) : "error: " + files.error().message + "\n";
    }
    (void)answer(common, object, text + end);
    return status;
  }
};

// They would be ignored, and a domain is easily taken for that of the keys.
void reject_network_options(const CLI::App& app) {
  for (const char* name : {"--domain", "--local", "--profile", "--discovery-server", "--timeout"}) {
    if (app.count(name) > 0) throw CLI::ValidationError(name, "has no meaning for keys");
  }
}

}  // namespace

void add_keys(Commands& commands) {
  CLI::App& keys =
      commands.add_parent_command("keys", "make and check keys and permissions", "keys check keys");
  keys.require_subcommand(1);
  keys.callback([&app = *keys.get_parent()] { reject_network_options(app); });
  commands.add<Init>(keys, "init", "create a key store with an authority", "keys init keys");
  commands.add<DaemonKeys>(keys, "daemon", "create the keys of the daemon of a partition",
                           "keys daemon keys arm --move base");
  commands.add<ClientKeys>(keys, "client", "create the keys of a client",
                           "keys client keys planner --look --move arm");
  commands.add<Renew>(keys, "renew", "replace keys; the roles stay", "keys renew keys planner");
  commands.add<Revoke>(keys, "revoke", "revoke an identity and delete its keys",
                       "keys revoke keys planner");
  commands.add<Check>(keys, "check", "say in words what each identity may do, and what is wrong",
                      "keys check keys");
}

}  // namespace tfdude::cli
