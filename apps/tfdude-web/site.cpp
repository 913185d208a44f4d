#include "site.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <utility>

namespace tfdude::web {
namespace {

constexpr const char* kCookie = "tfdude_token";

Reply say(unsigned status, const std::string& text) {
  Reply reply;
  reply.status = status;
  reply.body = std::make_shared<const std::string>(text + "\n");
  return reply;
}

// Compares in a time that does not depend on where they differ.
bool same(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned differs = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    differs |= static_cast<unsigned>(a[i] ^ b[i]);
  }
  return differs == 0;
}

// The parts of a text between separators, without blanks around them.
std::vector<std::string> parts_of(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    const std::size_t first = text.find_first_not_of(" \t", begin);
    if (first < end) {
      const std::size_t last = text.find_last_not_of(" \t", end - 1);
      parts.push_back(text.substr(first, last - first + 1));
    }
    begin = end + 1;
  }
  return parts;
}

std::string value_of(const std::string& text, char separator, const std::string& name) {
  for (const std::string& part : parts_of(text, separator)) {
    if (part.rfind(name + "=", 0) == 0) return part.substr(name.size() + 1);
  }
  return {};
}

// Whether a Host header names this computer. Other names may be made to point to it by a page of
// somebody else.
bool names_loopback(const std::string& host) {
  const std::size_t end =
      host.rfind('[', 0) == 0 ? std::min(host.find(']') + 1, host.size()) : host.find(':');
  const std::string name = host.substr(0, end);
  return name == "localhost" || name == "127.0.0.1" || name == "[::1]";
}

std::optional<std::string> type_of(const std::string& path) {
  static const std::map<std::string, std::string> types = {
      {".html", "text/html; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".json", "application/json; charset=utf-8"}};
  const auto found = types.find(std::filesystem::path(path).extension().string());
  return found == types.end() ? std::nullopt : std::optional<std::string>(found->second);
}

}  // namespace

std::string parameter(const std::string& query, const std::string& name) {
  return value_of(query, '&', name);
}

std::unique_ptr<Reply> reject(const Access& access, const Request& request) {
  if (access.loopback && !names_loopback(request.host)) {
    return std::make_unique<Reply>(say(403, "this server answers as localhost only"));
  }
  const bool own = request.origin.empty() || request.origin == "http://" + request.host ||
                   std::count(access.origins.begin(), access.origins.end(), request.origin) > 0;
  if (!own) {
    return std::make_unique<Reply>(
        say(403, "pages of " + request.origin + " may not connect; see --allow-origin"));
  }
  if (access.token.empty()) return nullptr;
  const bool known = same(parameter(request.query, "token"), access.token) ||
                     same(value_of(request.cookie, ';', kCookie), access.token);
  if (known) return nullptr;
  return std::make_unique<Reply>(say(401, "open the address that the server printed"));
}

std::string choose_protocol(const std::string& offered, const std::vector<std::string>& known) {
  for (const std::string& protocol : parts_of(offered, ',')) {
    if (std::count(known.begin(), known.end(), protocol) > 0) return protocol;
  }
  return {};
}

Result<void> Files::add_folder(const std::string& folder, const std::string& path) {
  std::error_code error;
  std::size_t added = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_regular_file() || !type_of(name)) continue;
    if (auto file = add_file(entry.path().string(), path + name); !file) return file;
    ++added;
  }
  if (error) return fail(Errc::kConfig, folder + ": " + error.message());
  if (added == 0) return fail(Errc::kConfig, folder + " has no files of the page");
  return {};
}

Result<void> Files::add_file(const std::string& file, const std::string& path) {
  std::ifstream stream(file, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream || content.empty()) return fail(Errc::kConfig, "cannot read " + file);
  add(path, type_of(file).value_or("application/octet-stream"), std::move(content));
  return {};
}

void Files::add(const std::string& path, const std::string& type, std::string content) {
  Reply& reply = files_[path];
  reply.type = type;
  reply.body = std::make_shared<const std::string>(std::move(content));
}

Reply Files::get(const std::string& path) const {
  const auto found = files_.find(path == "/" ? "/index.html" : path);
  return found == files_.end() ? say(404, "there is no " + path.substr(0, 200)) : found->second;
}

}  // namespace tfdude::web
