#include "tfdude/description/frame_file.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <unordered_map>
#include <utility>

#include "tfdude/base/id.hpp"

#include "description/file_edges.hpp"
#include "description/file_text.hpp"

namespace tfdude {
namespace {

constexpr std::array<FrameFormat, 8> kFormats = {
    FrameFormat::kKalibr, FrameFormat::kEyeOnHand, FrameFormat::kEyeOnBase, FrameFormat::kRos1,
    FrameFormat::kRos2,   FrameFormat::kOpenCv,    FrameFormat::kColmap,    FrameFormat::kG2o};

// Whether a line begins with the word, after blanks.
bool has_line(const std::string& text, std::string_view word) {
  TextLines lines(text);
  while (lines.next()) {
    const auto words = words_of(lines.line());
    if (!words.empty() && words[0].substr(0, word.size()) == word) return true;
  }
  return false;
}

// Whether the first line that is no comment is that of an image.
bool begins_with_image(const std::string& text) {
  TextLines lines(text);
  while (lines.next()) {
    const auto words = words_of(lines.line());
    if (words.empty() || words[0][0] == '#') continue;
    return words.size() >= 10 && count_of(words[0]) && numbers_of<7>(words, 1);
  }
  return false;
}

// Whether a file is YAML in flow style, as JSON is.
bool is_flow(const std::string& text) {
  TextLines lines(text);
  while (lines.next()) {
    const auto words = words_of(lines.line());
    const bool begins = !words.empty() && words[0][0] != '#' && words[0][0] != '%';
    if (begins && words[0] != "---") return words[0][0] == '{';
  }
  return false;
}

// Whether YAML has a key: at the begin of a line, or anywhere in flow style.
bool has_key(const std::string& text, const std::string& key, bool flow) {
  const std::string quoted = '"' + key + "\":";
  if (flow) {
    return text.find(quoted) != std::string::npos || text.find(key + ":") != std::string::npos;
  }
  return has_line(text, key + ":") || has_line(text, quoted);
}

Result<FrameFormat> format_of(const std::string& text, const std::string& name) {
  if (text.find("static_transform_publisher") != std::string::npos) return FrameFormat::kRos2;
  if (has_line(text, "VERTEX_SE3:QUAT") || has_line(text, "EDGE_SE3:QUAT")) {
    return FrameFormat::kG2o;
  }
  if (text.find("opencv-matrix") != std::string::npos) return FrameFormat::kOpenCv;
  const bool flow = is_flow(text);
  if (has_key(text, "tracking_base_frame", flow)) return FrameFormat::kEyeOnHand;
  if (has_key(text, "cam0", flow)) return FrameFormat::kKalibr;
  if (begins_with_image(text)) return FrameFormat::kColmap;
  return fail(Errc::kConfig, name + ": cannot tell its format: say which it is");
}

FileEdges read_edges(const std::string& text, const FrameFile& file, const std::string& name,
                     const std::string& covariances_name) {
  const auto format = file.format ? Result<FrameFormat>(*file.format) : format_of(text, name);
  if (!format) return tl::unexpected(format.error());
  if (!file.covariances.empty() && *format != FrameFormat::kColmap) {
    return fail(Errc::kInvalidInput, name + ": covariances of images are only for COLMAP");
  }
  switch (*format) {
    case FrameFormat::kKalibr:
      return read_kalibr(text, name);
    case FrameFormat::kEyeOnHand:
    case FrameFormat::kEyeOnBase:
      return read_hand_eye(text, name,
                           file.format.has_value()
                               ? std::optional(*format == FrameFormat::kEyeOnHand)
                               : std::nullopt);
    case FrameFormat::kRos1:
    case FrameFormat::kRos2:
      return read_launch(text, name);
    case FrameFormat::kOpenCv:
      return read_opencv(text, name);
    case FrameFormat::kColmap:
      return read_colmap(text, name, file.covariances, covariances_name);
    case FrameFormat::kG2o:
      return read_g2o(text, name);
  }
  return fail(Errc::kInvalidInput, name + ": unknown format");
}

// Names, units and covariances as they are here.
class Adopted {
 public:
  Adopted(const FrameFile& file, const std::string& name) : file_(file), name_(name) {}

  [[nodiscard]] Result<std::vector<FrameSpec>> frames(std::vector<FileEdge> edges) {
    if (!(file_.unit > 0 && file_.unit <= kMaxTranslation)) {
      return fail(Errc::kInvalidInput,
                  name_ + ": the unit must be more than 0 m and at most 1e9 m");
    }
    if (edges.empty())
      return fail(Errc::kConfig, name_ + ": has no frame that is placed in another");
    for (FileEdge& edge : edges) {
      if (auto ok = adopt(edge); !ok) return tl::unexpected(std::move(ok.error()));
    }
    for (const auto& [from, to] : file_.names) {
      const bool used = used_.count(from) > 0;
      if (!used) return fail(Errc::kInvalidInput, name_ + ": has no frame " + quote(from));
    }
    return sorted(edges);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(const FileEdge& edge,
                                            const std::string& message) const {
    return file_error(Errc::kInvalidInput, name_, edge.line,
                      "frame " + quote(edge.frame.id) + ": " + message);
  }

  [[nodiscard]] std::string named(const std::string& id) {
    const auto given = file_.names.find(id);
    if (given == file_.names.end()) return file_.prefix + id;
    used_[id] = true;
    return given->second;
  }

  [[nodiscard]] Result<void> adopt(FileEdge& edge) {
    FrameSpec& frame = edge.frame;
    frame.id = named(frame.id);
    frame.parent = named(frame.parent);
    if (auto ok = check_new_id(frame.id, "id"); !ok) return error(edge, ok.error().message);
    if (auto ok = check_new_id(frame.parent, "parent"); !ok) {
      return error(edge, ok.error().message);
    }
    Transform& X_PC = frame.X_PC;
    const auto scaled = Pose::create(X_PC.pose.rotation(), file_.unit * X_PC.pose.translation());
    if (!scaled) return error(edge, scaled.error().message);
    X_PC.pose = *scaled;
    if (file_.unit != 1) {
      Twist scale = Twist::Ones();
      scale.head<3>() *= file_.unit;
      if (const Covariance* given = X_PC.covariance.if_complete()) {
        const auto sigma =
            Covariance::from_matrix(scale.asDiagonal() * given->matrix() * scale.asDiagonal());
        if (!sigma) return error(edge, sigma.error().message);
        X_PC.covariance = *sigma;
      }
      for (CommonError& common : frame.correlation.common_errors) {
        common.loading = scale.asDiagonal() * common.loading;
      }
    }
    if (!X_PC.covariance.complete()) X_PC.covariance = file_.covariance;
    auto ok = check_common_errors(frame.correlation.common_errors);
    return ok ? ok : Result<void>(error(edge, ok.error().message));
  }

  // A parent before its children.
  [[nodiscard]] Result<std::vector<FrameSpec>> sorted(std::vector<FileEdge>& edges) const {
    std::unordered_map<std::string, std::size_t> place;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const auto [other, fresh] = place.emplace(edges[i].frame.id, i);
      if (fresh) continue;
      const int line = edges[other->second].line;
      return error(edges[i], "is placed twice, before in line " + std::to_string(line));
    }
    enum class State : char { kNew, kOpen, kDone };
    std::vector<State> states(edges.size(), State::kNew);
    std::vector<FrameSpec> frames;
    frames.reserve(edges.size());
    for (std::size_t i = 0; i < edges.size(); ++i) {
      std::vector<std::size_t> chain;  // from here up
      for (std::size_t at = i; states[at] != State::kDone;) {
        if (states[at] == State::kOpen) return error(edges[at], "is below itself");
        states[at] = State::kOpen;
        chain.push_back(at);
        const auto parent = place.find(edges[at].frame.parent);
        if (parent == place.end()) break;
        at = parent->second;
      }
      for (auto at = chain.rbegin(); at != chain.rend(); ++at) {
        states[*at] = State::kDone;
        frames.push_back(edges[*at].frame);
      }
    }
    return frames;
  }

  const FrameFile& file_;
  const std::string& name_;
  std::map<std::string, bool> used_;  // of the names that are given
};

Result<std::vector<FrameSpec>> parsed(const std::string& text, const FrameFile& file,
                                      const std::string& covariances_name) {
  const std::string name = printable(file.file);
  try {
    auto edges = read_edges(text, file, name, covariances_name);
    if (!edges) return tl::unexpected(std::move(edges.error()));
    return Adopted(file, name).frames(*std::move(edges));
  } catch (const std::exception& e) {
    return fail(Errc::kConfig, name + ": " + printable(e.what()));
  }
}

}  // namespace

const char* to_string(FrameFormat format) {
  constexpr std::array<const char*, kFormats.size()> kNames = {
      "kalibr", "eye-on-hand", "eye-on-base", "ros1", "ros2", "opencv", "colmap", "g2o"};
  return kNames[static_cast<std::size_t>(format)];
}

Result<FrameFormat> frame_format_named(std::string_view name) {
  std::string known;
  for (const FrameFormat format : kFormats) {
    if (name == to_string(format)) return format;
    known.append(known.empty() ? "" : ", ").append(to_string(format));
  }
  return fail(Errc::kInvalidInput, "unknown format " + quote(name) + "; known are " + known);
}

Result<std::vector<FrameSpec>> parse_frames(const std::string& text, const FrameFile& file) {
  return parsed(text, file, "covariances of " + printable(file.file));
}

Result<std::vector<FrameSpec>> load_frames(const FrameFile& file) {
  const auto text = read_text(file.file);
  if (!text) return tl::unexpected(text.error());
  FrameFile read = file;
  if (!file.covariances.empty()) {
    auto covariances = read_text(file.covariances);
    if (!covariances) return tl::unexpected(std::move(covariances.error()));
    read.covariances = *std::move(covariances);
  }
  return parsed(*text, read, printable(file.covariances));
}

}  // namespace tfdude
