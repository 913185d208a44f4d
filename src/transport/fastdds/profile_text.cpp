#include "transport/fastdds/profile_text.hpp"

#include <set>
#include <string_view>
#include <tinyxml2.h>

namespace tfdude::fastdds {
namespace {

using tinyxml2::XMLElement;

template <class Visit>
void for_each_child(XMLElement& parent, const Visit& visit) {
  for (auto* child = parent.FirstChildElement(); child != nullptr;) {
    auto* next = child->NextSiblingElement();  // the child may be taken out
    visit(*child);
    child = next;
  }
}

bool is(const XMLElement& element, std::string_view name) { return element.Name() == name; }

std::string text_of(const XMLElement& element) {
  const char* text = element.GetText();
  return text != nullptr ? text : "";
}

// Names of transports, where they are described and where they are used.
template <class Visit>
void for_each_transport(XMLElement& within, const Visit& visit) {
  for_each_child(within, [&](XMLElement& child) {
    if (is(child, "transport_id")) visit(child);
    for_each_transport(child, visit);
  });
}

void rename(XMLElement& profiles, const std::string& ending) {
  std::set<std::string> described;
  for_each_child(profiles, [&](XMLElement& child) {
    if (is(child, "transport_descriptors")) {
      for_each_transport(child, [&](XMLElement& id) { described.insert(text_of(id)); });
    }
    child.DeleteAttribute("is_default_profile");
    if (const char* name = child.Attribute("profile_name")) {
      child.SetAttribute("profile_name", (name + ending).c_str());
    }
  });
  // Other names belong to whoever described them.
  for_each_transport(profiles, [&](XMLElement& id) {
    const std::string name = text_of(id);
    if (described.count(name) != 0) id.SetText((name + ending).c_str());
  });
}

}  // namespace

Result<std::string> with_own_names(const std::string& xml, const std::string& ending) {
  tinyxml2::XMLDocument document;
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) {
    return fail(Errc::kConfig, std::string("not well-formed XML: ") + document.ErrorStr());
  }
  XMLElement& root = *document.RootElement();
  bool found = is(root, "profiles");
  if (found) {
    rename(root, ending);
  } else {
    for_each_child(root, [&](XMLElement& child) {
      if (!is(child, "profiles")) return root.DeleteChild(&child);
      found = true;
      rename(child, ending);
    });
  }
  if (!found) return fail(Errc::kConfig, "it has no profiles");
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return std::string(printer.CStr());
}

std::string only_profile(const std::string& xml, const std::string& name) {
  tinyxml2::XMLDocument document;
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) return {};
  XMLElement& profiles = *document.RootElement();
  bool transports = false;
  for_each_child(profiles, [&](XMLElement& child) {
    if (is(child, "participant") && child.Attribute("profile_name", name.c_str()))
      transports = true;
  });
  for_each_child(profiles, [&](XMLElement& child) {
    const bool kept = is(child, "transport_descriptors")
                          ? transports
                          : child.Attribute("profile_name", name.c_str()) != nullptr;
    if (!kept) profiles.DeleteChild(&child);
  });
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace tfdude::fastdds
