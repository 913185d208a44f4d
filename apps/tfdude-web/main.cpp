// Shows all frames of a domain to browsers, until a signal stops it. Changes nothing.

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <string_view>

#include <spdlog/spdlog.h>

#include "../process.hpp"
#include "foxglove_talk.hpp"
#include "live.hpp"
#include "meshes.hpp"
#include "page_talk.hpp"
#include "reader_process.hpp"
#include "recordings.hpp"
#include "settings.hpp"
#include "site.hpp"

namespace {

using namespace tfdude;
using web::Access;
using web::Files;
using web::Settings;

constexpr const char* kThree = "/usr/share/javascript/three/";

std::string page_folder() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return program.parent_path() / TFDUDE_PAGE_FROM_PROGRAM;
}

Result<Files> read_files(const Settings& settings) {
  Files files;
  if (auto page = files.add_folder(page_folder(), "/"); !page) return tl::unexpected(page.error());
  for (const char* part :
       {"build/three.module.js", "examples/jsm/controls/OrbitControls.js",
        "examples/jsm/loaders/ColladaLoader.js", "examples/jsm/loaders/STLLoader.js",
        "examples/jsm/loaders/TGALoader.js"}) {
    if (auto three = files.add_file(std::string(kThree) + part, std::string("/three/") + part);
        !three) {
      return fail(Errc::kConfig,
                  three.error().message + "; Debian's package libjs-three is needed");
    }
  }
  const auto left_out = web::add_meshes(settings.urdf, settings.packages, files);
  if (!left_out) return tl::unexpected(left_out.error());
  for (const std::string& remark : *left_out) spdlog::warn("{}", remark);
  return files;
}

// 128 bits of the system's generator.
std::string new_token() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) {
    char digits[9];
    std::snprintf(digits, sizeof(digits), "%08x", random());
    token += digits;
  }
  return token;
}

bool is_loopback(const std::string& address) {
  return address.rfind("127.", 0) == 0 || address == "::1";
}

web::Site make_site(web::Live& live, web::Recordings& recordings, const Files& files,
                    const Access& access, const web::Post& post) {
  web::Site site;
  site.get = [&files, access](const web::Request& request) {
    if (const auto reply = web::reject(access, request)) return *reply;
    web::Reply reply = files.get(request.path);
    const std::string token = web::parameter(request.query, "token");
    if (!access.token.empty() && !token.empty()) {
      reply.set_cookie = "tfdude_token=" + token + "; HttpOnly; SameSite=Strict; Path=/";
    }
    return reply;
  };
  site.accept = [&live, &recordings, access,
                 post](const web::Request& request) -> tl::expected<web::Accepted, web::Reply> {
    if (auto reply = web::reject(access, request)) return tl::unexpected(*reply);
    std::vector<std::string> known = web::kFoxgloveProtocols;
    known.emplace_back(web::kPageProtocol);
    const std::string protocol = web::choose_protocol(request.protocols, known);
    if (protocol.empty()) {
      web::Reply reply;
      reply.status = 400;
      reply.body = std::make_shared<const std::string>("no known subprotocol is offered\n");
      return tl::unexpected(reply);
    }
    return web::Accepted{protocol, protocol == web::kPageProtocol
                                       ? web::talk_to_page(live, recordings, post)
                                       : web::talk_to_foxglove(live)};
  };
  site.tick = [&live, &recordings] {
    live.tick();
    recordings.tick();
  };
  return site;
}

int serve(const Settings& settings, const sigset_t& stop_signals) {
  const auto files = [&] {
    const cli::EndAtSignals ends;
    return read_files(settings);
  }();
  auto live = files ? web::Live::open(settings.options, settings.server.rate)
                    : tl::unexpected(files.error());
  if (!live) {
    spdlog::error("{}", live.error().message);
    return live.error().code == Errc::kConfig ? cli::kWrongUsage : cli::kRejected;
  }
  Access access;
  access.loopback = is_loopback(settings.server.address);
  if (!access.loopback) access.token = new_token();
  access.origins = settings.origins;
  std::unique_ptr<web::Recordings> recordings;
  const auto opened = web::Server::open(settings.server, [&](const web::Post& post) {
    recordings = std::make_unique<web::Recordings>(settings.most_recording << 20U, post);
    return make_site(**live, *recordings, *files, access, post);
  });
  if (!opened) {
    spdlog::error("{}", opened.error().message);
    return opened.error().code == Errc::kInvalidInput ? cli::kWrongUsage : cli::kRejected;
  }
  web::Server& server = **opened;
  const bool six = settings.server.address.find(':') != std::string::npos;
  const std::string host = six ? "[" + settings.server.address + "]" : settings.server.address;
  std::printf("open http://%s:%u/%s\n", host.c_str(), server.port(),
              access.token.empty() ? "" : ("?token=" + access.token).c_str());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&stop_signals, &signal);
  spdlog::info("stopping on signal {}", signal);
  (*live)->worker().stop();
  server.stop();
  recordings->stop();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == web::kReaderArgument) return web::read_recording();
  Settings settings;
  if (const auto status = web::read_arguments(argc, argv, settings)) return *status;
  const sigset_t stop_signals = cli::block_stop_signals();
  // A file that a page sends may reach the limit of this process; the write tells it.
  std::signal(SIGXFSZ, SIG_IGN);
  cli::log_to_standard_error();
  const int status = serve(settings, stop_signals);
  spdlog::shutdown();
  return status;
}
