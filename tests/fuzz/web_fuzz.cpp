// Reads any bytes as what clients of tfdude-web send: the head of a request, a page's message, and
// a text or binary message of Foxglove's protocol.

#include <cstdint>
#include <string>
#include <string_view>

#include "tfdude/base/id.hpp"

#include "fuzz/demand.hpp"
#include "tfdude-web/foxglove_request.hpp"
#include "tfdude-web/request.hpp"
#include "tfdude-web/site.hpp"
#include "tfdude-web/upload.hpp"

namespace tfdude::fuzz {
namespace {

void read_page(std::string_view bytes) {
  const auto request = web::parse_request(bytes);
  if (!request) return;
  if (const auto* pair = std::get_if<web::PairRequest>(&*request)) {
    demand(pair->a.empty() == pair->b.empty(), "a pair has two ends or none");
    demand(pair->a.empty() || (check_id(pair->a, "a") && check_id(pair->b, "b")), "ends are ids");
  } else if (const auto* past = std::get_if<web::PastRequest>(&*request)) {
    demand(nanoseconds(past->at) >= 0, "an instant is not negative");
  }
}

void read_foxglove(std::string_view bytes) {
  for (const bool binary : {false, true}) {
    const auto request = web::foxglove::parse_client(bytes, binary);
    if (!request) continue;
    demand(!binary || std::holds_alternative<web::foxglove::NotOffered>(*request),
           "binary messages ask for nothing");
  }
}

// A file in pieces: each two bytes are a size, and how much was written since the last one.
void read_upload(std::string_view bytes) {
  if (bytes.empty()) return;
  const auto start = web::Upload::Clock::now();
  const std::uint64_t size = static_cast<unsigned char>(bytes[0]) * std::uint64_t{10'000};
  if (!web::check_size(size, 2'000'000)) return;
  web::Upload upload(size, start);
  for (std::size_t i = 1; i + 1 < bytes.size() && !upload.complete(); i += 2) {
    const auto piece = static_cast<std::size_t>(static_cast<unsigned char>(bytes[i])) * 258;
    const bool whole = static_cast<unsigned char>(bytes[i]) == 255;
    (void)upload.receive(whole ? web::Upload::kPiece : piece, start);
    const std::uint64_t ahead = upload.received() - upload.written();
    demand(upload.received() <= size, "no more comes than was said");
    demand(ahead <= web::Upload::kAhead * web::Upload::kPiece, "the memory of pieces is bounded");
    if (bytes[i + 1] % 2 != 0) upload.write(ahead);
  }
  demand(!upload.complete() || upload.received() == size, "all has come");
  (void)web::check_beginning(bytes);
}

// The fields of a request, one a line.
void read_head(std::string_view bytes) {
  web::Request request;
  std::string* fields[] = {&request.path,   &request.query,  &request.host,
                           &request.origin, &request.cookie, &request.protocols};
  std::size_t field = 0;
  for (const char byte : bytes) {
    if (byte == '\n' && field + 1 < std::size(fields)) {
      ++field;
    } else {
      fields[field]->push_back(byte);
    }
  }
  const std::string token = "0123456789abcdef0123456789abcdef";
  const bool known = bytes.find(token) != std::string_view::npos;
  const web::Access remote{false, token, {}};
  demand(known || web::reject(remote, request) != nullptr, "nobody enters without the token");
  const web::Access local{true, {}, {}};
  if (web::reject(local, request) == nullptr) {
    const bool own = request.origin.empty() || request.origin == "http://" + request.host;
    demand(own, "a page of others does not connect");
  }
  const std::string chosen =
      web::choose_protocol(request.protocols, {"tfdude.v1", "foxglove.sdk.v1"});
  demand(chosen.empty() || request.protocols.find(chosen) != std::string::npos,
         "a protocol was offered");
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  tfdude::fuzz::read_page(bytes);
  tfdude::fuzz::read_foxglove(bytes);
  tfdude::fuzz::read_head(bytes);
  tfdude::fuzz::read_upload(bytes);
  return 0;
}
