#include "description/yaml_quirks.hpp"

#include <algorithm>
#include <optional>
#include <sstream>
#include <unordered_map>
#include <utility>
#include <vector>

#include <yaml-cpp/eventhandler.h>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

constexpr std::size_t kMostRepeated = 2'000'000;
constexpr std::size_t kDeepest = 500;  // as yaml-cpp itself, which does not follow aliases

// Measures the nodes of documents, with aliases written out, and keeps the first fault.
class DocumentChecks final : public YAML::EventHandler {
 public:
  struct Fault {
    YAML::Mark mark;
    std::string what;
  };
  [[nodiscard]] const std::optional<Fault>& fault() const { return fault_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ == 2) reject(mark, "holds more than one YAML document");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& /*mark*/, YAML::anchor_t anchor) override { end({anchor, 1, 1}); }
  void OnScalar(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t anchor,
                const std::string& /*value*/) override {
    end({anchor, 1, 1});
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end()) {
      return reject(mark, "an alias stands for what it is in");
    }
    Extent of{0, found->second.nodes, found->second.depth};
    repeated_ += of.nodes;
    if (repeated_ > kMostRepeated) {
      reject(mark, "aliases repeat more than " + std::to_string(kMostRepeated) + " values");
    }
    if (open_.size() + of.depth > kDeepest) {
      reject(mark, "aliases nest more than " + std::to_string(kDeepest) + " levels");
    }
    // What is rejected needs no true size, which could exceed any number.
    if (fault_) of = {0, 1, 1};
    end(of);
  }
  void OnSequenceStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/,
                       YAML::anchor_t anchor, YAML::EmitterStyle::value /*style*/) override {
    open_.push_back({anchor, 1, 1});
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    open_.push_back({anchor, 1, 1});
  }
  void OnMapEnd() override { close(); }

 private:
  // A node with all below it.
  struct Extent {
    YAML::anchor_t anchor;  // 0: none
    std::size_t nodes;
    std::size_t depth;
  };

  void close() {
    const Extent node = open_.back();
    open_.pop_back();
    end(node);
  }

  void end(const Extent& node) {
    if (node.anchor != 0) anchored_.emplace(node.anchor, node);
    if (open_.empty()) return;
    open_.back().nodes += node.nodes;
    open_.back().depth = std::max(open_.back().depth, node.depth + 1);
  }

  void reject(const YAML::Mark& mark, std::string what) {
    if (!fault_) fault_ = Fault{mark, std::move(what)};
  }

  int documents_ = 0;
  std::vector<Extent> open_;
  std::unordered_map<YAML::anchor_t, Extent> anchored_;
  std::size_t repeated_ = 0;
  std::optional<Fault> fault_;
};

}  // namespace

Result<void> check_bytes(const std::string& name, const std::string& text) {
  int line = 1;
  for (const char c : text) {
    if (c == '\n') ++line;
    if ((c >= 0 && c < ' ' && c != '\n' && c != '\r' && c != '\t') || c == '\x7f') {
      return fail(Errc::kConfig, name + ":" + std::to_string(line) +
                                     ": holds the control character " +
                                     quote(std::string_view(&c, 1)));
    }
  }
  return {};
}

bool is_quoted(const YAML::Node& scalar) { return scalar.Tag() == "!"; }

std::string plain_number(const std::string& text) {
  std::string number = text.substr(!text.empty() && text[0] == '+' ? 1 : 0);
  const std::size_t sign = !number.empty() && number[0] == '-' ? 1 : 0;
  const std::string rest = number.substr(sign);
  for (const char* word : {".inf", ".Inf", ".INF", ".nan", ".NaN", ".NAN"}) {
    if (rest == word) number.erase(sign, 1);
  }
  return number;
}

// Does not use YAML::LoadAll(): for "!!str ," it finds document after document without advancing,
// and never returns.
Result<void> check_documents(const std::string& name, const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentChecks checks;
  (void)(parser.HandleNextDocument(checks) && parser.HandleNextDocument(checks));
  if (!checks.fault()) return {};
  const auto& [mark, what] = *checks.fault();
  return fail(Errc::kConfig, name + ":" + std::to_string(mark.line + 1) + ": " + what);
}

}  // namespace tfdude
