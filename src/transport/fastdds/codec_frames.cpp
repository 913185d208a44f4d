#include "transport/fastdds/codec_frames.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec_correlation.hpp"

namespace tfdude::fastdds {
namespace {

Result<std::vector<std::string>> read_ids(const std::vector<wire::Identifier>& body,
                                          const char* field) {
  std::vector<std::string> ids;
  ids.reserve(body.size());
  for (const wire::Identifier& id : body) {
    if (auto ok = check_id(text(id), field); !ok) return tl::unexpected(std::move(ok.error()));
    ids.push_back(string_of(id));
  }
  return ids;
}

Result<KnownFrame> read_frame(const wire::KnownFrame& body) {
  KnownFrame frame{string_of(body.id()), string_of(body.parent()), string_of(body.owner())};
  if (auto ok = check_id(frame.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  if (auto ok = check_id(frame.parent, "parent"); !frame.parent.empty() && !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  if (auto ok = check_partition_name(frame.partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  return frame;
}

}  // namespace

wire::FramesBody write_frames(const FramesRequest& asked) {
  wire::FramesBody body;
  for (const std::string& id : asked.ids) body.ids().emplace_back(id);
  for (const std::string& tree : asked.trees) body.trees().emplace_back(tree);
  body.seen().resize(asked.seen.size());
  for (std::size_t i = 0; i < asked.seen.size(); ++i) {
    body.seen()[i].partition(asked.seen[i].partition);
    body.seen()[i].epoch(asked.seen[i].epoch);
  }
  return body;
}

std::vector<wire::KnownFrame> write_frames(const std::vector<KnownFrame>& known) {
  std::vector<wire::KnownFrame> body(known.size());
  for (std::size_t i = 0; i < known.size(); ++i) {
    body[i].id(known[i].id);
    body[i].parent(known[i].parent);
    body[i].owner(known[i].partition);
  }
  return body;
}

Result<FramesRequest> read_frames(const wire::FramesBody& body) {
  FramesRequest asked;
  auto ids = read_ids(body.ids(), "id");
  if (!ids) return tl::unexpected(std::move(ids.error()));
  asked.ids = *std::move(ids);
  auto trees = read_ids(body.trees(), "tree");
  if (!trees) return tl::unexpected(std::move(trees.error()));
  asked.trees = *std::move(trees);
  for (const wire::SeenEpoch& one : body.seen()) {
    asked.seen.push_back({string_of(one.partition()), one.epoch()});
    if (auto ok = check_partition_name(asked.seen.back().partition); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
  }
  return asked;
}

Result<std::vector<KnownFrame>> read_frames(const std::vector<wire::KnownFrame>& body) {
  std::vector<KnownFrame> known;
  known.reserve(body.size());
  for (const wire::KnownFrame& in : body) {
    auto frame = read_frame(in);
    if (!frame) return tl::unexpected(std::move(frame.error()));
    known.push_back(*std::move(frame));
  }
  return known;
}

}  // namespace tfdude::fastdds
