#include <cctype>
#include <sstream>

#include "facts.hpp"

// What the rules of a firewall may do to the messages of a domain.
namespace tfdude::cli {
namespace {

bool has(const std::string& line, std::string_view word) {
  return line.find(word) != std::string::npos;
}

// The destination ports of UDP that a rule names; none: it names none.
std::vector<Ports> udp_ports(const std::string& rule) {
  std::vector<Ports> ports;
  const auto at = rule.find("udp dport ");
  if (at == std::string::npos) return ports;
  std::string text = rule.substr(at + 10);
  // "7400-7649 accept" or "{ 53, 7400-7649 } accept"
  text = text.substr(0, text.front() == '{' ? text.find('}') : text.find(' '));
  for (std::size_t i = 0; i < text.size();) {
    if (std::isdigit(static_cast<unsigned char>(text[i])) == 0) {
      ++i;
      continue;
    }
    char* end = nullptr;
    const auto number = [&end](const char* digits) {
      return static_cast<std::uint32_t>(std::strtoul(digits, &end, 10));
    };
    const std::uint32_t first = number(text.c_str() + i);
    const std::uint32_t last = *end == '-' ? number(end + 1) : first;
    ports.push_back({first, last});
    i = static_cast<std::size_t>(end - text.c_str());
  }
  return ports;
}

bool any_overlaps(const std::vector<Ports>& ports, const Ports& range) {
  for (const Ports& one : ports) {
    if (one.first <= range.last && range.first <= one.last) return true;
  }
  return false;
}

bool drops(const std::string& rule) { return has(rule, " drop") || has(rule, " reject"); }

// Drops what is of no interest here.
bool is_harmless(const std::string& rule) {
  return has(rule, "ct state invalid") || has(rule, "tcp ") || has(rule, "icmp") ||
         has(rule, "ip6 ") || has(rule, "meta nfproto ipv6");
}

std::string trimmed(const std::string& line) {
  const auto first = line.find_first_not_of(" \t");
  return first == std::string::npos ? "" : line.substr(first);
}

// A chain of rules for what arrives, or leaves, while its text is read.
struct Chain {
  std::string name;
  bool hooked = false;
  bool drops_rest = false;
  bool accepts = false;  // the domain's ports
};

}  // namespace

std::vector<std::string> blocking_rules(const std::string& ruleset, std::uint32_t domain) {
  const Ports ports = ports_of(domain);
  std::vector<std::string> blocking;
  std::string table;
  Chain chain;
  std::istringstream lines(ruleset);
  for (std::string line; std::getline(lines, line);) {
    line = trimmed(line);
    if (line.rfind("table ", 0) == 0) {
      table = line.substr(6, line.find(" {") - 6);
    } else if (line.rfind("chain ", 0) == 0) {
      chain = {"chain " + table + " " + line.substr(6, line.find(" {") - 6)};
    } else if (has(line, "hook input") || has(line, "hook output") ||
               has(line, "hook prerouting")) {
      chain.hooked = true;
      chain.drops_rest = has(line, "policy drop");
    } else if (line == "}") {
      if (chain.hooked && chain.drops_rest && !chain.accepts) {
        blocking.push_back(chain.name + ": policy drop");
      }
      chain = {};
    } else if (chain.hooked && any_overlaps(udp_ports(line), ports)) {
      if (drops(line)) blocking.push_back(chain.name + ": " + line);
      chain.accepts = chain.accepts || has(line, "accept");
    } else if (chain.hooked && drops(line) && udp_ports(line).empty() && !is_harmless(line)) {
      blocking.push_back(chain.name + ": " + line);
    }
  }
  return blocking;
}

}  // namespace tfdude::cli
