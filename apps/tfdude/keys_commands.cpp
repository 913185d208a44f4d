#include "keys_commands.hpp"

#include <string>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/keys/key_files.hpp"
#include "tfdude/keys/key_store.hpp"

#include "render.hpp"

namespace tfdude::cli {
namespace {

using nlohmann::json;

Days lifetime_of(const KeysArguments& keys, Days otherwise) {
  return keys.lifetime == Days(0) ? otherwise : keys.lifetime;
}

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
          {"serves", roles.serves ? json(*roles.serves) : json()},
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
int answer_done(const Arguments& arguments, const char* done, const Result<KeyFiles>& files) {
  if (!files) return report(files.error(), arguments);
  json object = identity_json(*files);
  object["done"] = done;
  return answer(arguments, object, std::string(done) + " " + identity_text(*files));
}

int run_init(const Arguments& arguments) {
  const KeysArguments& keys = arguments.keys;
  const KeySettings settings{!keys.sign, {keys.domains[0], keys.domains[1]}};
  const Time now = wall_clock();
  const auto created =
      create_key_store(keys.directory, settings, lifetime_of(keys, kAuthorityLifetime), now);
  if (!created) return report(created.error(), arguments);
  const auto info = read_key_store(keys.directory, now);
  if (!info) return report(info.error(), arguments);
  return answer(
      arguments,
      {{"done", "created"}, {"authority", info->authority}, {"until", to_string(info->until)}},
      "created '" + info->authority + "', valid until " + to_string(info->until) + "; " +
          protection_of(settings) + "\n");
}

int add(const Arguments& arguments, const std::string& name, const Roles& roles) {
  const KeysArguments& keys = arguments.keys;
  return answer_done(arguments, "created",
                     add_identity(keys.directory, name, roles, lifetime_of(keys, kIdentityLifetime),
                                  wall_clock()));
}

int run_daemon(const Arguments& arguments) {
  const KeysArguments& keys = arguments.keys;
  Roles roles = keys.roles;
  roles.serves = keys.partition;
  return add(arguments, keys.name.empty() ? keys.partition : keys.name, roles);
}

int run_client(const Arguments& arguments) {
  return add(arguments, arguments.keys.name, arguments.keys.roles);
}

// One identity, or all of them until one fails.
int run_renew(const Arguments& arguments) {
  const KeysArguments& keys = arguments.keys;
  const Time now = wall_clock();
  std::vector<std::string> names{keys.name};
  if (keys.name.empty()) {
    const auto info = read_key_store(keys.directory, now);
    if (!info) return report(info.error(), arguments);
    names = info->identities;
  }
  for (const std::string& name : names) {
    const int status = answer_done(
        arguments, "renewed",
        renew_identity(keys.directory, name, lifetime_of(keys, kIdentityLifetime), now));
    if (status != kDone) return status;
  }
  return kDone;
}

int run_revoke(const Arguments& arguments) {
  const KeysArguments& keys = arguments.keys;
  const auto revoked = revoke_identity(keys.directory, keys.name, wall_clock());
  if (!revoked) return report(revoked.error(), arguments);
  return answer(
      arguments, {{"done", "revoked"}, {"identity", keys.name}},
      "revoked " + keys.name +
          "; to make it known, copy revoked.pem of each identity to its host, and restart "
          "what uses it\n");
}

int run_check(const Arguments& arguments) {
  const std::string& directory = arguments.keys.directory;
  const Time now = wall_clock();
  std::vector<std::string> identities{directory};
  json object;
  std::string text;
  std::string end;
  if (is_key_store(directory)) {
    const auto info = read_key_store(directory, now);
    if (!info) return report(info.error(), arguments);
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
    if (!files) status = kRefused;
    object["identities"].push_back(files ? identity_json(*files)
                                         : json({{"error", files.error().message}}));
    text += files ? identity_text(*files) : "error: " + files.error().message + "\n";
  }
  (void)answer(arguments, object, text + end);
  return status;
}

// They would be ignored, and a domain is easily taken for that of the keys.
void reject_network_options(const CLI::App& app) {
  for (const char* name : {"--domain", "--local", "--profile", "--discovery-server", "--timeout"}) {
    if (app.count(name) > 0) throw CLI::ValidationError(name, "has no meaning for keys");
  }
}

CLI::App* add_command(CLI::App& group, const char* name, const char* help, const char* example,
                      KeysArguments& keys, LocalCommand run, LocalCommand& chosen) {
  CLI::App* command = group.add_subcommand(name, help);
  command->footer(std::string("Example: tfdude keys ") + example);
  command->callback([&chosen, &app = *group.get_parent(), run = std::move(run)] {
    reject_network_options(app);
    chosen = run;
  });
  command->add_option("DIR", keys.directory, "the key store")->required();
  return command;
}

void add_lifetime(CLI::App* command, KeysArguments& keys, const char* help) {
  command
      ->add_option_function<int>(
          "--days", [&keys](int days) { keys.lifetime = Days(days); }, help)
      ->check(CLI::Range(1, kMaxLifetime.count()));
}

void add_roles(CLI::App* command, KeysArguments& keys) {
  const auto add_partitions = [&](const char* name, std::set<std::string>& partitions,
                                  const char* help) {
    command
        ->add_option_function<std::vector<std::string>>(
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
  };
  command->add_flag("--look", keys.roles.look,
                    "may ask for poses, joints and paths; --move and --observe include it");
  add_partitions("--move", keys.roles.move, "a partition that it may change in any way; repeat");
  add_partitions("--stream", keys.roles.stream,
                 "a partition to which it may stream values and joints; repeat");
  command->add_flag("--observe", keys.roles.observe,
                    "may send observations, and all other changes, to all partitions");
  command->add_flag("--publish-clock", keys.roles.clock, "may publish the time of external clocks");
}

}  // namespace

void add_keys_commands(CLI::App& app, KeysArguments& keys, LocalCommand& chosen) {
  CLI::App* group = app.add_subcommand("keys", "make and check keys and permissions");
  group->require_subcommand(1);
  group->footer("Example: tfdude keys check keys");
  CLI::App* init = add_command(*group, "init", "create a key store with an authority", "init keys",
                               keys, run_init, chosen);
  init->add_flag("--sign", keys.sign, "messages are signed only, so anybody can read them");
  init->add_option("--domains", keys.domains, "the DDS domains; default: 0 232")
      ->type_name("FIRST LAST")
      ->expected(2)
      ->check(CLI::Range(0, 232));
  add_lifetime(init, keys, "how long the authority is valid; default: 3650");
  CLI::App* daemon = add_command(*group, "daemon", "create the keys of the daemon of a partition",
                                 "daemon keys arm --move base", keys, run_daemon, chosen);
  daemon->add_option("PARTITION", keys.partition, "the partition that it serves")->required();
  daemon->add_option("--name", keys.name, "the identity, if not named like the partition");
  CLI::App* client = add_command(*group, "client", "create the keys of a client",
                                 "client keys planner --look --move arm", keys, run_client, chosen);
  client->add_option("NAME", keys.name, "the identity")->required();
  CLI::App* renew = add_command(*group, "renew", "replace keys; the roles stay",
                                "renew keys planner", keys, run_renew, chosen);
  renew->add_option("NAME", keys.name, "the identity; default: all");
  for (CLI::App* command : {daemon, client, renew}) {
    add_lifetime(command, keys, "how long they are valid; default: 365");
    if (command != renew) add_roles(command, keys);
  }
  add_command(*group, "revoke", "revoke an identity and delete its keys", "revoke keys planner",
              keys, run_revoke, chosen)
      ->add_option("NAME", keys.name, "the identity")
      ->required();
  add_command(*group, "check", "say in words what each identity may do, and what is wrong",
              "check keys", keys, run_check, chosen);
}

}  // namespace tfdude::cli
