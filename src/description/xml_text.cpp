#include "description/xml_text.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "tfdude/base/id.hpp"

#include "description/file_text.hpp"

namespace tfdude {
namespace {

// Turns "XML_ERROR_MISMATCHED_ELEMENT" into the style of all messages.
std::string reason(const tinyxml2::XMLDocument& document) {
  std::string name = document.ErrorName();
  constexpr std::string_view kStart = "XML_ERROR_";
  if (name.rfind(kStart, 0) == 0) name.erase(0, kStart.size());
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) {
    return c == '_' ? ' ' : static_cast<char>(std::tolower(c));
  });
  return name;
}

// The line of an element with more attributes than any URDF has; 0: there is none. TinyXML compares
// each with all before it, so a million of them would take hours.
int line_of_too_many_attributes(std::string_view text) {
  constexpr std::size_t kMost = 256;
  const auto skip_to = [&text](std::size_t from, std::string_view end) {
    const auto at = text.find(end, from);
    return at == std::string_view::npos ? text.size() : at + end.size();
  };
  for (std::size_t at = text.find('<'); at < text.size(); at = text.find('<', at)) {
    const std::string_view rest = text.substr(at);
    if (rest.rfind("<!--", 0) == 0) {
      at = skip_to(at, "-->");
      continue;
    }
    if (rest.rfind("<![CDATA[", 0) == 0) {
      at = skip_to(at, "]]>");
      continue;
    }
    const std::size_t begin = at;
    std::size_t attributes = 0;
    for (++at; at < text.size() && text[at] != '>'; ++at) {
      if (text[at] == '=') ++attributes;
      if (text[at] != '"' && text[at] != '\'') continue;
      at = std::min(text.find(text[at], at + 1), text.size());
      if (at == text.size()) break;
    }
    if (attributes <= kMost) continue;
    return 1 + static_cast<int>(
                   std::count(text.begin(), text.begin() + static_cast<long>(begin), '\n'));
  }
  return 0;
}

// The line of a document type that declares entities, whose names TinyXML would leave as they are;
// 0: there is none.
int line_of_entities(const tinyxml2::XMLDocument& document) {
  for (const auto* node = document.FirstChild(); node != nullptr; node = node->NextSibling()) {
    if (node->ToUnknown() == nullptr) continue;
    // TinyXML ends one at the first '>', and a further declaration is then one of its own.
    const std::string_view value = node->Value();
    const bool declares =
        value.rfind("ENTITY", 0) == 0 || value.find("<!ENTITY") != std::string_view::npos;
    if (declares) return node->GetLineNum();
  }
  return 0;
}

}  // namespace

Result<const tinyxml2::XMLElement*> parse_xml(tinyxml2::XMLDocument& document,
                                              const std::string& text, const std::string& file) {
  if (const auto zero = text.find('\0'); zero != std::string::npos) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<long>(zero), '\n');
    return file_error(Errc::kConfig, file, static_cast<int>(line), "not XML: holds a zero byte");
  }
  if (const int line = line_of_too_many_attributes(text); line > 0) {
    return file_error(Errc::kTooMuch, file, line, "an element has more than 256 attributes");
  }
  if (document.Parse(text.data(), text.size()) == tinyxml2::XML_ERROR_EMPTY_DOCUMENT) {
    return fail(Errc::kConfig, file + ": is empty");
  }
  if (document.Error()) {
    return file_error(Errc::kConfig, file, document.ErrorLineNum(), "not XML: " + reason(document));
  }
  if (const int line = line_of_entities(document); line > 0) {
    return file_error(Errc::kConfig, file, line,
                      "entities are not read: write what they stand for instead of their names");
  }
  const tinyxml2::XMLElement* root = document.RootElement();
  const auto* second = root == nullptr ? nullptr : root->NextSiblingElement();
  if (second == nullptr) return root;
  return file_error(
      Errc::kConfig, file, second->GetLineNum(),
      std::string("not XML: <") + second->Name() + "> after the end of <" + root->Name() + ">");
}

}  // namespace tfdude
