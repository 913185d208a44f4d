#include "description/yaml_quirks.hpp"

#include <sstream>

#include <yaml-cpp/eventhandler.h>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// Records the start of a document, and ignores its contents.
class DocumentStart final : public YAML::EventHandler {
 public:
  [[nodiscard]] const YAML::Mark& mark() const { return mark_; }

  void OnDocumentStart(const YAML::Mark& mark) override { mark_ = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}

 private:
  YAML::Mark mark_;
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
std::optional<YAML::Mark> second_document(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentStart handler;
  const bool two = parser.HandleNextDocument(handler) && parser.HandleNextDocument(handler);
  return two ? std::optional(handler.mark()) : std::nullopt;
}

}  // namespace tfdude
