#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/partition/directory.hpp"
#include "tfdude/partition/messages.hpp"
#include "tfdude/partition/pages.hpp"
#include "tfdude/partition/reply_cache.hpp"
#include "tfdude/tree/forest.hpp"

namespace tfdude {

/// A frame as a configuration gives it; an empty parent makes a root.
struct FrameSpec {
  std::string id;
  std::string parent;
  Transform X_PC;
};

/// The rules of an owner: what it answers to each request, and what it publishes of its structure.
///
/// @par Thread safety  The caller serializes all functions that change the structure, answer() among
///   them, with those of the directory; answer_lookup() and apply() may run beside anything.
class Partition {
 public:
  Partition(std::string name, std::uint64_t incarnation, Forest& forest, Directory& directory);

  [[nodiscard]] const std::string& name() const { return name_; }

  /// Takes the frames of a configuration, in any order; parents may be missing. All or none.
  /// @return the first frame's error: a bad or repeated id, a cycle.
  [[nodiscard]] Result<void> load(const std::vector<FrameSpec>& frames);

  /// Answers any request of a peer; a repeated one as before.
  [[nodiscard]] Reply answer(const PeerId& peer, const Request& request);

  /// Answers a request of the owner's own process.
  [[nodiscard]] Reply answer(const Request& request);

  /// Answers a request that reads.
  [[nodiscard]] Reply answer_lookup(std::uint32_t sequence, const LookupRequest& lookup) const;

  /// Applies those edges of a stream that are owned here, as one commit.
  /// @return how many
  std::size_t apply(const Update& update);

  /// The pages to publish since the last call.
  [[nodiscard]] std::vector<Page> take_pages() { return pages_.take_changed(); }
  [[nodiscard]] std::uint32_t page_count() const { return pages_.count(); }
  [[nodiscard]] std::size_t frame_count() const { return pages_.frame_count(); }

 private:
  [[nodiscard]] Result<void> apply(const Request& request);
  [[nodiscard]] Result<void> add(const std::string& id, const AddRequest& request);
  [[nodiscard]] Result<void> remove(const RemoveRequest& request);
  [[nodiscard]] Result<void> move(const std::string& id, const MoveRequest& request);
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges);
  [[nodiscard]] Error at_home(Error error, std::string_view id) const;

  std::string name_;
  Forest& forest_;
  Directory& directory_;
  Pages pages_;
  ReplyCache replies_;
};

}  // namespace tfdude
