#include "description/xml_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <optional>
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

int line_at(std::string_view text, std::size_t at) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(at);
  return 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
}

std::size_t after(std::string_view text, std::string_view end, std::size_t from) {
  const auto at = text.find(end, from);
  return at == std::string_view::npos ? text.size() : at + end.size();
}

// Where TinyXML goes on after the markup at `at`, if it is no tag of an element; else `at`. Only in
// tags it knows quotes.
std::size_t after_other_markup(std::string_view text, std::size_t at) {
  constexpr std::array<std::array<std::string_view, 2>, 4> kKinds = {
      {{"<?", "?>"}, {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<!", ">"}}};
  for (const auto& [begin, end] : kKinds) {
    if (text.compare(at, begin.size(), begin) == 0) return after(text, end, at + begin.size());
  }
  return at;
}

struct TooMuch {
  std::size_t at;
  const char* what;
};

// TinyXML compares each attribute with all before it, so a million of them would take hours, and
// keeps more than a hundred bytes of each element.
std::optional<TooMuch> find_too_much(std::string_view text) {
  constexpr std::size_t kMostAttributes = 256;
  constexpr std::size_t kMostTags = 2'000'000;
  std::size_t tags = 0;
  for (std::size_t at = text.find('<'); at < text.size(); at = text.find('<', at)) {
    const std::size_t begin = at;
    if (++tags > kMostTags) return TooMuch{begin, "has more than 2000000 tags"};
    at = after_other_markup(text, begin);
    if (at != begin) continue;
    std::size_t attributes = 0;
    for (++at; at < text.size() && text[at] != '>'; ++at) {
      if (text[at] == '=') ++attributes;
      if (text[at] != '"' && text[at] != '\'') continue;
      at = std::min(text.find(text[at], at + 1), text.size());
      if (at == text.size()) break;
    }
    if (attributes > kMostAttributes) {
      return TooMuch{begin, "an element has more than 256 attributes"};
    }
  }
  return std::nullopt;
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
    return file_error(Errc::kConfig, file, line_at(text, zero), "not XML: holds a zero byte");
  }
  if (const auto found = find_too_much(text)) {
    return file_error(Errc::kTooMuch, file, line_at(text, found->at), found->what);
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
