#include "meshes.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <system_error>
#include <tinyxml2.h>

#include <nlohmann/json.hpp>

#include "tfdude/description/urdf_file.hpp"
#include "tfdude/math/pose.hpp"

#include "../rendering/json.hpp"

namespace tfdude::web {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using tinyxml2::XMLElement;

constexpr std::size_t kMostVisuals = 2000;
constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20U;  // of a mesh
constexpr std::uintmax_t kMostBytesOfAll = std::uintmax_t{512} << 20U;

std::string attribute(const XMLElement* element, const char* name) {
  const char* text = element == nullptr ? nullptr : element->Attribute(name);
  return text == nullptr ? std::string() : text;
}

// The numbers of an attribute.
template <std::size_t N = 3>
std::array<double, N> numbers(const XMLElement* element, const char* name, double absent) {
  std::array<double, N> values{};
  values.fill(absent);
  std::istringstream stream(attribute(element, name));
  for (double& value : values) {
    if (!(stream >> value)) value = absent;
  }
  return values;
}

// The rotation of an origin, which newer URDFs may give as a quaternion.
std::array<double, 3> rpy_of(const XMLElement* origin) {
  const auto [x, y, z, w] = numbers<4>(origin, "quat_xyzw", 0);
  const Eigen::Quaterniond q(w, x, y, z);
  if (!(q.norm() > 0)) return numbers(origin, "rpy", 0);
  const Eigen::Vector3d rpy = to_rpy(q.normalized());
  return {rpy.x(), rpy.y(), rpy.z()};
}

std::string ending_of(const fs::path& file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool is_below(const fs::path& file, const fs::path& folder) {
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), file.begin(), file.end());
  return end == folder.end() && rest != file.end();
}

// Finds the files that a URDF names.
class Finder {
 public:
  Finder(const std::string& urdf, const std::vector<std::string>& folders) {
    std::error_code ignored;
    own_ = fs::canonical(fs::path(urdf), ignored).parent_path();
    for (const std::string& folder : folders) {
      const fs::path path = fs::canonical(folder, ignored);
      if (!path.empty()) folders_.push_back(path);
    }
  }

  // The file of a name, without links, if it is below a folder.
  [[nodiscard]] std::optional<fs::path> find(const std::string& name) const {
    static const std::string package = "package://";
    static const std::string scheme = "file://";
    std::vector<fs::path> wishes;
    if (name.rfind(package, 0) == 0) {
      const std::string rest = name.substr(package.size());
      const std::size_t slash = std::min(rest.find('/'), rest.size());
      for (const fs::path& folder : folders_) {
        wishes.push_back(folder / rest);
        if (folder.filename() == rest.substr(0, slash) && slash < rest.size()) {
          wishes.push_back(folder / rest.substr(slash + 1));
        }
      }
    } else {
      wishes.push_back(name.rfind(scheme, 0) == 0 ? fs::path(name.substr(scheme.size()))
                                                  : own_ / name);
    }
    for (const fs::path& wish : wishes) {
      std::error_code error;
      const fs::path file = fs::canonical(wish, error);
      if (error || !fs::is_regular_file(file, error)) continue;
      const bool allowed = is_below(file, own_) ||
                           std::any_of(folders_.begin(), folders_.end(),
                                       [&](const fs::path& one) { return is_below(file, one); });
      if (allowed && fs::file_size(file, error) <= kMostBytes) return file;
    }
    return std::nullopt;
  }

 private:
  fs::path own_;
  std::vector<fs::path> folders_;
};

// The meshes that are served: each file once, however many visuals show it.
class Meshes {
 public:
  explicit Meshes(Files& files) : files_(files) {}

  /// The path of a mesh; nothing if it cannot be served.
  [[nodiscard]] std::optional<std::string> add(const fs::path& file) {
    const auto known = paths_.find(file.string());
    if (known != paths_.end()) return known->second;
    const std::string ending = ending_of(file);
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    if (error || (ending != ".stl" && ending != ".dae") || bytes_ + size > kMostBytesOfAll) {
      return std::nullopt;
    }
    const std::string path = "/mesh/" + std::to_string(paths_.size()) + ending;
    if (!files_.add_file(file.string(), path)) return std::nullopt;
    bytes_ += size;
    paths_.emplace(file.string(), path);
    return path;
  }

 private:
  Files& files_;
  std::map<std::string, std::string> paths_;
  std::uintmax_t bytes_ = 0;
};

// The shape of a visual; nothing if it cannot be shown.
std::optional<json> shape_of(const XMLElement* geometry, const Finder& finder, Meshes& meshes,
                             std::vector<std::string>& left_out) {
  if (geometry == nullptr) return std::nullopt;
  if (const auto* box = geometry->FirstChildElement("box")) {
    return json{{"box", numbers(box, "size", 1)}};
  }
  if (const auto* cylinder = geometry->FirstChildElement("cylinder")) {
    return json{{"cylinder",
                 {cylinder->DoubleAttribute("radius", 1), cylinder->DoubleAttribute("length", 1)}}};
  }
  if (const auto* sphere = geometry->FirstChildElement("sphere")) {
    return json{{"sphere", sphere->DoubleAttribute("radius", 1)}};
  }
  const auto* mesh = geometry->FirstChildElement("mesh");
  const std::string name = attribute(mesh, "filename");
  const auto file = finder.find(name);
  const auto path = file ? meshes.add(*file) : std::nullopt;
  if (!path) {
    left_out.push_back("mesh '" + name +
                       "': no STL or Collada file below the folders, or too large");
    return std::nullopt;
  }
  return json{{"mesh", *path}, {"scale", numbers(mesh, "scale", 1)}};
}

}  // namespace

Result<std::vector<std::string>> add_meshes(const std::string& urdf,
                                            const std::vector<std::string>& folders, Files& files) {
  json visuals = json::array();
  std::vector<std::string> left_out;
  if (!urdf.empty()) {
    const auto text = load_urdf_text(urdf);
    if (!text) return tl::unexpected(text.error());
    tinyxml2::XMLDocument document;
    document.Parse(text->data(), text->size());
    const XMLElement* robot = document.RootElement();
    const Finder finder(urdf, folders);
    Meshes meshes(files);
    for (auto* link = robot->FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      for (auto* visual = link->FirstChildElement("visual");
           visual != nullptr && visuals.size() < kMostVisuals;
           visual = visual->NextSiblingElement("visual")) {
        auto shape = shape_of(visual->FirstChildElement("geometry"), finder, meshes, left_out);
        if (!shape) continue;
        const XMLElement* origin = visual->FirstChildElement("origin");
        (*shape)["link"] = attribute(link, "name");
        (*shape)["xyz"] = numbers(origin, "xyz", 0);
        (*shape)["rpy"] = rpy_of(origin);
        visuals.push_back(std::move(*shape));
      }
    }
  }
  files.add("/robot.json", "application/json; charset=utf-8",
            cli::dump({{"visuals", std::move(visuals)}}));
  return left_out;
}

}  // namespace tfdude::web
