#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <Eigen/Eigenvalues>

#include "tfdude/base/id.hpp"
#include "tfdude/math/perturbation.hpp"

#include "description/file_edges.hpp"
#include "description/file_text.hpp"
#include "description/g2o_graph.hpp"

namespace tfdude {
namespace {

// Tells the errors of one graph from those of another; the same file again has the same errors.
std::string source_of(const std::string& text) {
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  constexpr const char* kDigits = "0123456789abcdef";
  std::string digits;
  for (int shift = 60; shift >= 0; shift -= 4) digits += kDigits[(hash >> unsigned(shift)) & 15U];
  return "graph:" + digits + ":";
}

class GraphReader {
 public:
  explicit GraphReader(const std::string& name) : name_(name) {}

  [[nodiscard]] Result<void> read(const std::string& text) {
    TextLines lines(text);
    while (lines.next()) {
      line_ = lines.number();
      words_ = words_of(lines.line());
      if (words_.empty()) continue;
      if (words_[0][0] == '#') {
        comment(lines.line());
        continue;
      }
      const auto earlier = std::exchange(earlier_, std::nullopt);
      if (earlier && words_.size() > 1 && words_[0] == "VERTEX_SE3:QUAT" &&
          words_[1] == earlier->first) {
        names_.insert(*earlier);
      }
      auto ok = words_[0] == "VERTEX_SE3:QUAT" ? vertex()
                : words_[0] == "EDGE_SE3:QUAT" ? edge()
                : words_[0] == "FIX"
                    ? fix()
                    : Result<void>(error(quote(words_[0]) +
                                         " is not known: a graph of VERTEX_SE3:QUAT and "
                                         "EDGE_SE3:QUAT is needed"));
      if (!ok) return ok;
    }
    for (const auto& [from, to, at] : ends_) {
      auto& edge = graph_.edges[at];
      for (const auto& [id, index] : {std::pair(&from, &edge.from), std::pair(&to, &edge.to)}) {
        const auto found = index_.find(*id);
        line_ = edge.line;
        if (found == index_.end()) return error("there is no vertex " + *id);
        *index = found->second;
      }
    }
    for (const auto& [id, line] : fixed_) {
      const auto found = index_.find(id);
      line_ = line;
      if (found == index_.end()) return error("there is no vertex " + id);
      graph_.vertices[found->second].fixed = true;
    }
    return {};
  }

  [[nodiscard]] FileEdges edges(const std::string& text) const {
    std::vector<G2oError> errors;
    if (!graph_.edges.empty()) {
      auto computed = g2o_errors(graph_, source_of(text), name_);
      if (!computed) return tl::unexpected(std::move(computed.error()));
      errors = *std::move(computed);
    }
    std::vector<FileEdge> edges;
    for (std::size_t i = 0; i < graph_.vertices.size(); ++i) {
      FileEdge edge;
      edge.line = graph_.vertices[i].line;
      const auto named = names_.find(graph_.ids[i]);
      edge.frame.id = named == names_.end() ? graph_.ids[i] : named->second;
      edge.frame.parent = "map";
      edge.frame.X_PC.pose = graph_.vertices[i].X_MV;
      if (!errors.empty()) {
        edge.frame.X_PC.covariance = errors[i].own;
        edge.frame.correlation.common_errors = std::move(errors[i].common_errors);
      }
      if (!is_parent_itself(edge.frame)) edges.push_back(std::move(edge));
    }
    return edges;
  }

 private:
  // A vertex of the parent's name that stands exactly there, as the root of a written tree does.
  [[nodiscard]] static bool is_parent_itself(const FrameSpec& frame) {
    const Transform& X = frame.X_PC;
    return frame.id == frame.parent && log(X.pose).isZero(0) &&
           X.covariance.of_specified().matrix().isZero(0) &&
           frame.correlation.common_errors.empty();
  }

  [[nodiscard]] tl::unexpected<Error> error(const std::string& message) const {
    return file_error(Errc::kInvalidInput, name_, line_, message);
  }

  // A name that write_frames() has noted. Earlier versions wrote "# frame NUMBER NAME" before the
  // vertex; only there, and of one word, it is no remark of somebody else.
  void comment(std::string_view line) {
    earlier_.reset();
    if (words_.size() >= 5 && line.substr(0, kG2oName.size()) == kG2oName) {
      const auto begin = static_cast<std::size_t>(words_[4].data() - line.data());
      const std::string_view last = words_.back();
      const auto end = static_cast<std::size_t>(last.data() + last.size() - line.data());
      names_[std::string(words_[3])] = line.substr(begin, end - begin);
    } else if (words_.size() == 4 && words_[0] == "#" && words_[1] == "frame") {
      earlier_.emplace(words_[2], words_[3]);
    }
  }

  [[nodiscard]] Result<Pose> pose(std::size_t first) const {
    const auto numbers = numbers_of<7>(words_, first);
    if (!numbers) return error("the pose is not x y z qx qy qz qw");
    const auto& [x, y, z, qx, qy, qz, qw] = *numbers;
    const auto pose = Pose::create({qw, qx, qy, qz}, {x, y, z});
    return pose ? pose : Result<Pose>(error(pose.error().message));
  }

  [[nodiscard]] Result<void> vertex() {
    if (words_.size() != 9) return error("is not VERTEX_SE3:QUAT ID x y z qx qy qz qw");
    const auto X_MV = pose(2);
    if (!X_MV) return tl::unexpected(X_MV.error());
    if (!count_of(words_[1])) return error(quote(words_[1]) + " is no number of a vertex");
    const std::string id(words_[1]);
    if (!index_.emplace(id, graph_.vertices.size()).second) {
      return error("vertex " + id + " is given twice");
    }
    graph_.vertices.push_back({*X_MV, false, line_});
    graph_.ids.push_back(id);
    return {};
  }

  [[nodiscard]] Result<void> edge() {
    constexpr std::size_t kFirst = 10;
    const auto upper = numbers_of<Covariance::kSize>(words_, kFirst);
    if (words_.size() != kFirst + Covariance::kSize || !upper) {
      return error("is not EDGE_SE3:QUAT FROM TO x y z qx qy qz qw and 21 numbers of information");
    }
    if (words_[1] == words_[2]) return error("an edge from a vertex to itself");
    const auto Z = pose(3);
    if (!Z) return tl::unexpected(Z.error());
    Matrix6d information;
    for (std::size_t row = 0; row < 6; ++row) {
      for (std::size_t column = row; column < 6; ++column) {
        const auto i = static_cast<Eigen::Index>(row);
        const auto j = static_cast<Eigen::Index>(column);
        information(i, j) = information(j, i) = (*upper)[upper_index(row, column)];
      }
    }
    constexpr double kRounding = 1e-6;
    const auto values = information.selfadjointView<Eigen::Upper>().eigenvalues();
    if (!(values.minCoeff() >= -kRounding * values.maxCoeff())) {
      return error("the information is not positive semi-definite");
    }
    ends_.push_back({std::string(words_[1]), std::string(words_[2]), graph_.edges.size()});
    graph_.edges.push_back({0, 0, *Z, information, line_});
    return {};
  }

  [[nodiscard]] Result<void> fix() {
    if (words_.size() < 2) return error("FIX names no vertex");
    for (std::size_t i = 1; i < words_.size(); ++i) fixed_.emplace_back(words_[i], line_);
    return {};
  }

  struct Ends {
    std::string from;
    std::string to;
    std::size_t edge = 0;
  };

  const std::string& name_;
  std::vector<std::string_view> words_;  // of the line
  int line_ = 0;
  G2oGraph graph_;
  std::map<std::string, std::size_t> index_;  // of vertices
  std::vector<Ends> ends_;                    // vertices may stand behind their edges
  std::vector<std::pair<std::string, int>> fixed_;
  std::map<std::string, std::string> names_;
  std::optional<std::pair<std::string, std::string>> earlier_;  // what the line before names
};

}  // namespace

FileEdges read_g2o(const std::string& text, const std::string& name) {
  GraphReader reader(name);
  if (auto ok = reader.read(text); !ok) return tl::unexpected(std::move(ok.error()));
  return reader.edges(text);
}

}  // namespace tfdude
