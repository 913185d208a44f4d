// Passes any bytes to a participant on the topic of requests, and checks an owner's answer.

#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "fuzz/wire.hpp"
#include "partition/partition.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

void strip(wire::Request& sample, std::vector<fastdds::Numbers>& out) {
  sample.addressee(0);
  wire::RequestBody& body = sample.body();
  switch (body._d()) {
    case 1:
      take_out(body.add().x_pc(), out);
      break;
    case 3:
      take_out(body.update().x_pc(), out);
      for (wire::Edge& edge : body.update().more()) take_out(edge.x_pc(), out);
      break;
    case 2:
    case 4:
    case 6:
    case 12:
      break;
    default:
      // Of these a message does not keep all that can be said in several ways.
      body = wire::RequestBody();
  }
}

// Of an owner of a few frames, with some of the names in the seeds.
void demand_answer(const Request& request) {
  testing::Replica replica("robot");
  Partition robot("robot", 1, replica.forest, replica.directory);
  demand(robot.load({{"world", "", {}}, {"arm", "world", {}}, {"hand", "arm", {}}}, Time{})
             .has_value(),
         "the owner has frames");
  const Reply reply = robot.answer(PeerId{}, request, Time{});
  demand(reply.sequence == request.sequence, "a reply has its request's number");
  const auto arrived = fastdds::from_wire(travelled<fastdds::ReplyType>(fastdds::to_wire(reply)));
  demand(arrived.has_value(), "a reply arrives");
  demand(arrived->body.index() == reply.body.index(), "a reply arrives as what it was");
  demand(robot.frame_count() == replica.forest.frames().size(),
         "an owner publishes the frames that it holds");
}

void run(const Bytes& bytes) {
  const bool well_formed = fastdds::well_formed_request(bytes.data(), bytes.size());
  const auto sample = received<fastdds::RequestType, wire::Request>(bytes, well_formed);
  if (!sample) return;
  const auto head = fastdds::read_request_head(bytes.data(), bytes.size());
  demand(head.has_value(), "a request has a head");
  demand(head->id == sample->id().c_str() && head->addressee == sample->addressee(),
         "the head is read as the whole is");
  const auto request = round_trip<fastdds::RequestType>(
      *sample, [](const Request& message) { return fastdds::to_wire(message, "robot"); },
      [](const wire::Request& wire) { return fastdds::from_wire(wire); }, strip);
  if (request) demand_answer(*request);
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
