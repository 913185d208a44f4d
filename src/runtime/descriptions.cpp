#include "runtime/descriptions.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// Those of files are not larger.
constexpr std::uint64_t kMaxDescription = std::uint64_t{64} << 20U;

// FNV-1a with 64 bits.
std::uint64_t hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

}  // namespace

Descriptions::Descriptions(Requests& requests, std::string own)
    : requests_(requests), own_(std::move(own)), hash_(hash_of(own_)) {}

Reply Descriptions::answer(const Request& request) const {
  const std::uint64_t from = std::get<DescriptionRequest>(request.body).from;
  DescriptionPart part{own_.size(), hash_, {}};
  if (from < own_.size()) part.text = own_.substr(from, kMaxDescriptionPart);
  return {request.sequence, 0, std::move(part)};
}

Result<DescriptionPart> Descriptions::ask(const std::string& partition, std::uint64_t from,
                                          const Deadline& deadline) {
  auto asked =
      requests_.ask_partition<DescriptionPart>(partition, DescriptionRequest{from}, deadline);
  if (!asked) return tl::unexpected(std::move(asked.error()));
  if (*asked) return **std::move(asked);
  return fail(Errc::kUnsupported,
              "partition " + quote(partition) + " gave another answer than that it was asked for");
}

Result<std::string> Descriptions::of(const std::string& partition, const Deadline& deadline) {
  std::string text;
  std::uint64_t hash = 0;
  std::uint64_t size = 0;
  while (true) {
    auto part = ask(partition, text.size(), deadline);
    if (!part) return tl::unexpected(std::move(part.error()));
    if (part->size == 0) return std::string();
    if (part->size > kMaxDescription) {
      return fail(Errc::kTooMuch, "partition " + quote(partition) + " has a description of " +
                                      std::to_string(part->size) + " bytes");
    }
    if (!text.empty() && (part->hash != hash || part->size != size)) {
      // The text was replaced meanwhile.
      if (deadline.over()) {
        return fail(Errc::kTimeout, "the description of partition " + quote(partition) +
                                        " is replaced again and again");
      }
      text.clear();
      continue;
    }
    hash = part->hash;
    size = part->size;
    text += part->text;
    if (text.size() == part->size && hash_of(text) == hash) return text;
    if (part->text.empty() || text.size() >= part->size) {
      return fail(Errc::kInvalidInput, "partition " + quote(partition) +
                                           " sent a description that does not fit its size");
    }
  }
}

}  // namespace tfdude
