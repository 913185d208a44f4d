// Passes any bytes to a participant on the topic of replies.

#include <variant>
#include <vector>

#include "fuzz/wire.hpp"

namespace tfdude::fuzz {
namespace {

void strip(wire::Reply& sample, std::vector<fastdds::Numbers>& out) {
  wire::ReplyBody& body = sample.body();
  if (body._d() == 1) {
    body.error().message(printable(body.error().message()).substr(0, 4096));
  } else if (body._d() == 2) {
    for (fastdds::Numbers& X : body.transforms()) take_out(X, out);
  } else if (body._d() == 3) {
    body.done(0);
  } else {
    // Of these a message does not keep all that can be said in several ways.
    body = wire::ReplyBody();
  }
}

void run(const Bytes& bytes) {
  const bool well_formed = fastdds::well_formed_reply(bytes.data(), bytes.size());
  const auto sample = received<fastdds::ReplyType, wire::Reply>(bytes, well_formed);
  if (!sample) return;
  const auto reply = round_trip<fastdds::ReplyType>(
      *sample, [](const Reply& message) { return fastdds::to_wire(message); },
      [](const wire::Reply& wire) { return fastdds::from_wire(wire); }, strip);
  if (!reply) return;
  if (const auto* error = std::get_if<Error>(&reply->body)) {
    if (!error->message.empty()) demand_printable(*error);
    demand(!to_string(error->code).empty(), "every code has a name");
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
