#include "tree/remote_forest.hpp"

#include <cstring>
#include <initializer_list>
#include <utility>
#include <vector>

namespace tfdude {
namespace {

// Increase it if the same bytes mean something else.
constexpr std::uint64_t kLayout = 2;

// How many newer versions a reader passes. An owner that has written more of one edge, while
// somebody reads, has overwritten what is read anyway.
constexpr int kMostNewer = 1024;

constexpr std::uint64_t kMostChunks = std::uint64_t{1} << 24U;
constexpr std::uint64_t kMostNames = std::uint64_t{1} << 28U;
constexpr std::size_t kMostText = 4096;

template <class T>
std::uint64_t word_of(const T& object) {
  static_assert(sizeof(T) >= sizeof(std::uint64_t));
  std::uint64_t word = 0;
  std::memcpy(&word, &object, sizeof(word));
  return word;
}

template <class Whole, class Part>
std::uint64_t place_of(const Whole& whole, const Part& part) {
  // NOLINTNEXTLINE(*-reinterpret-cast): addresses only
  return reinterpret_cast<std::uint64_t>(&part) - reinterpret_cast<std::uint64_t>(&whole);
}

// For copies.
Arena& heap() {
  static Arena heap;
  return heap;
}

std::uint64_t hash_of_words(std::initializer_list<std::uint64_t> words) {
  // FNV-1a.
  std::uint64_t hash = 14695981039346656037U;
  for (const std::uint64_t word : words) {
    for (unsigned i = 0; i < 8; ++i) {
      hash = (hash ^ ((word >> (8 * i)) & 0xFFU)) * 1099511628211U;
    }
  }
  return hash;
}

}  // namespace

std::uint64_t layout_hash() {
  static const std::uint64_t hash = [] {
    const HeldVersion held;
    const Sample sample;
    const SharedRoots roots;
    const Name name;
    const EdgeTiming timing;
    const SharedJoint joint;
    const SharedCovariance covariance;
    const EdgeCorrelation correlation(heap(), {});
    const SharedRevision revision(heap(), {});
    // The order of both parts of a view.
    const std::string_view view("12345678", 3);
    return hash_of_words({kLayout,
                          word_of(kLayout),
                          sizeof(roots),
                          sizeof(Version),
                          sizeof(held),
                          sizeof(sample),
                          sizeof(SampleChunk),
                          SampleChunk::kSize,
                          sizeof(SampleHistory),
                          sizeof(covariance),
                          sizeof(correlation),
                          sizeof(revision),
                          sizeof(FlatCorrelation),
                          sizeof(FlatCorrelation::Entry),
                          sizeof(joint),
                          sizeof(name),
                          sizeof(IdTable::Table),
                          sizeof(timing),
                          SlotArray::kFirst,
                          SampleHistory::layout(),
                          place_of(held, held.X_PC),
                          place_of(held, held.samples),
                          place_of(held, held.correlation),
                          place_of(held, held.stamp),
                          place_of(held, held.number),
                          place_of(held, held.attachment),
                          place_of(sample, sample.shared),
                          place_of(roots, roots.horizon),
                          place_of(roots, roots.heads),
                          place_of(name, name.slot),
                          place_of(timing, timing.process_noise),
                          place_of(timing, timing.drifts),
                          place_of(covariance, covariance.revision),
                          place_of(correlation, correlation.flat_said()),
                          place_of(correlation, correlation.flat_now()),
                          place_of(revision, revision.given),
                          place_of(revision, revision.flat()),
                          place_of(joint, joint.joint),
                          std::uint64_t{word_of(view) == view.size()},
                          IdTable::hash_of("tf-dude: the layout")});
  }();
  return hash;
}

Result<RemoteForest> RemoteForest::open(const void* memory, std::size_t size) {
  const auto* roots = static_cast<const SharedRoots*>(memory);
  if (size < sizeof(SharedRoots) || roots->magic != SharedRoots::kMagic) {
    return fail(Errc::kUnsupported, "it is no memory of an owner");
  }
  if (roots->layout != layout_hash()) {
    return fail(Errc::kUnsupported, "it has another layout: its owner is another build");
  }
  if (roots->size > size) return fail(Errc::kUnsupported, "it is smaller than it says");
  return RemoteForest(*roots, size);
}

const Version* RemoteForest::at(const Head& head, std::uint64_t commit) const {
  const Version* version = here(static_cast<const Version*>(head.load(std::memory_order_acquire)));
  for (int newer = 0; version != nullptr && load(version->commit) > commit; ++newer) {
    if (newer == kMostNewer) return nullptr;
    version = here(static_cast<const Version*>(load(version->older)));
  }
  return version;
}

const HeldVersion* RemoteForest::older(const RemotePlace& place, std::uint64_t commit) const {
  const Version* version = at(*place.head, commit);
  if (version == nullptr || !is(*version, place)) return nullptr;
  // Again as a larger object, at this process's address, as the owner's may have changed.
  // NOLINTNEXTLINE(*-reinterpret-cast): an address only
  const auto offset = static_cast<std::uint64_t>(reinterpret_cast<const char*>(version) - memory_);
  const bool fits = sizeof(HeldVersion) <= size_ - offset && offset % alignof(HeldVersion) == 0;
  return fits ? static_cast<const HeldVersion*>(version) : nullptr;
}

const Head* RemoteForest::head_of(std::uint32_t slot) const {
  const std::uint32_t biased = slot + SlotArray::kFirst;
  if (biased < slot) return nullptr;
  const auto segment = static_cast<unsigned>(31 - __builtin_clz(biased) - SlotArray::kFirstBits);
  const auto* theirs =
      static_cast<const Head*>(roots_->heads[segment].load(std::memory_order_acquire));
  const Head* heads = here(theirs, std::uint64_t{SlotArray::kFirst} << segment);
  return heads != nullptr ? heads + (biased - (SlotArray::kFirst << segment)) : nullptr;
}

std::string_view RemoteForest::text_of(const Name* theirs) const {
  const Name* name = here(theirs);
  if (name == nullptr) return {};
  std::string_view text;
  std::memcpy(&text, &name->text, sizeof(text));
  if (text.size() > kMostText) return {};
  const char* bytes = here(text.data(), text.size());
  return bytes != nullptr ? std::string_view(bytes, text.size()) : std::string_view();
}

const Name* RemoteForest::name_of(std::string_view id) const {
  using Table = IdTable::Table;
  const auto* theirs = static_cast<const Table*>(roots_->names.load(std::memory_order_acquire));
  const Table* table = here(theirs);
  const std::uint64_t mask = table != nullptr ? load(table->mask) : kMostNames;
  if (mask >= kMostNames) return nullptr;
  // NOLINTNEXTLINE(*-reinterpret-cast): as Table::cells()
  const auto* cells = here(reinterpret_cast<const Table::Cell*>(theirs + 1), mask + 1);
  if (cells == nullptr) return nullptr;
  const std::uint32_t hash = IdTable::hash_of(id);
  for (std::uint64_t probes = 0; probes <= mask; ++probes) {
    const Name* called = cells[(hash + probes) & mask].load(std::memory_order_acquire);
    if (called == nullptr) return nullptr;
    const Name* name = here(called);
    if (name != nullptr && load(name->hash) == hash && text_of(called) == id) return called;
  }
  return nullptr;
}

bool RemoteForest::is_edge(const Version& version, const Name* called, std::string_view parent,
                           std::uint64_t commit) const {
  if (parent.empty() || load(version.name) != called || load(version.attachment) == 0) return false;
  if (load(version.owner) != kHeldHere) return false;
  const Head* above = here(load(version.above));
  const Version* top = above != nullptr ? at(*above, commit) : nullptr;
  return top != nullptr && text_of(load(top->name)) == parent;
}

const Head* RemoteForest::head_of(const Name* called) const {
  const Name* name = here(called);
  return name != nullptr ? head_of(load(name->slot)) : nullptr;
}

template <class Is>
RemoteForest::Former RemoteForest::last_where(const Head& head, std::uint64_t commit, Is is) const {
  const Version* version = at(head, commit);
  // The version was that of the slot up to this commit.
  std::uint64_t last = commit;
  for (int newer = 0; version != nullptr && newer < kMostNewer; ++newer) {
    const std::uint64_t since = load(version->commit);
    if (since == 0 || since > last) return {};
    if (is(*version, last)) return {version, last};
    last = since - 1;
    version = here(static_cast<const Version*>(load(version->older)));
  }
  return {};
}

std::optional<RemotePlace> RemoteForest::find(std::string_view id, std::string_view parent,
                                              std::uint64_t commit) const {
  const Name* called = name_of(id);
  const Head* head = head_of(called);
  const Version* version = head != nullptr ? at(*head, commit) : nullptr;
  if (version == nullptr || !is_edge(*version, called, parent, commit)) return std::nullopt;
  const RemotePlace found{head, load(version->attachment)};
  if (at(found, commit) == nullptr) return std::nullopt;
  return found;
}

std::optional<RemotePlace> RemoteForest::find_former(std::string_view id, std::string_view parent,
                                                     std::uint64_t commit) const {
  const Name* called = name_of(id);
  const Head* head = head_of(called);
  if (head == nullptr) return std::nullopt;
  const Former former = last_where(*head, commit, [&](const Version& version, std::uint64_t last) {
    return is_edge(version, called, parent, last);
  });
  if (former.version == nullptr) return std::nullopt;
  const RemotePlace found{head, load(former.version->attachment)};
  if (!intact(former.commit)) return std::nullopt;
  return found;
}

std::uint64_t RemoteForest::last_commit_of(const RemotePlace& place, std::uint64_t commit) const {
  return last_where(*place.head, commit,
                    [&](const Version& version, std::uint64_t) { return is(version, place); })
      .commit;
}

bool RemoteEdge::read(const FlatCorrelation* theirs, Correlation& copy) const {
  const FlatCorrelation* head = forest->here(theirs);
  const std::uint32_t bytes = head != nullptr ? RemoteForest::load(head->bytes) : 0;
  if (bytes < sizeof(FlatCorrelation) || bytes > FlatCorrelation::kMostBytes) return false;
  // NOLINTNEXTLINE(*-reinterpret-cast): of bytes
  const char* block = forest->here(reinterpret_cast<const char*>(theirs), bytes);
  if (block == nullptr) return false;
  const std::vector<char> once(block, block + bytes);
  return read_flat(once.data(), bytes, *common_errors_left, copy);
}

bool RemoteEdge::find(Copy& copy, const Correlation*& found, bool now) const {
  const EdgeCorrelation* theirs = RemoteForest::load(version->correlation);
  if (theirs == nullptr) return true;
  const EdgeCorrelation* correlation = forest->here(theirs);
  if (correlation == nullptr) return false;
  found = &copy;
  const FlatCorrelation* of_now = now ? RemoteForest::load(correlation->flat_now()) : nullptr;
  return read(of_now != nullptr ? of_now : RemoteForest::load(correlation->flat_said()), copy);
}

bool RemoteSamples::is_set(const bool& flag) {
  std::uint8_t byte = 0;
  std::memcpy(&byte, &flag, sizeof(byte));
  return byte != 0;
}

RemoteSamples::RemoteSamples(const RemoteEdge& edge)
    : edge_(edge),
      forest_(*edge.forest),
      samples_(forest_.here(
          static_cast<const SampleHistory*>(RemoteForest::load(edge.version->samples)))) {
  if (samples_ == nullptr) return;
  mask_ = RemoteForest::load(samples_->mask());
  if (mask_ >= kMostChunks) return;
  chunks_ = forest_.here(
      static_cast<const std::atomic<SampleChunk*>*>(RemoteForest::load(samples_->chunks())),
      mask_ + 1);
}

const Sample* RemoteSamples::sample(std::uint64_t number) const {
  if (!there()) return nullptr;
  const std::uint64_t index = number / SampleChunk::kSize;
  const SampleChunk* chunk = forest_.here(
      static_cast<const SampleChunk*>(chunks_[index & mask_].load(std::memory_order_acquire)));
  const bool same =
      chunk != nullptr && RemoteForest::load(chunk->first) == index * SampleChunk::kSize;
  return same ? &chunk->samples[number % SampleChunk::kSize] : nullptr;
}

bool RemoteSamples::given_parts(const Sample& sample, TransformParts& parts) const {
  const auto* shared =
      forest_.here(static_cast<const SharedCovariance*>(RemoteForest::load(sample.shared)));
  if (shared == nullptr || is_set(shared->is_joint) || !is_set(shared->is_given)) return false;
  parts = {&sample.pose(), &shared->covariance};
  return true;
}

bool RemoteSamples::copy(const Sample& sample, Copies::One& copy) const {
  copy.sample = sample;
  const SharedPart* theirs = copy.sample.shared;
  const SharedPart* shared = forest_.here(theirs);
  if (shared == nullptr) return false;
  if (is_set(shared->is_joint)) {
    const auto* joint = forest_.here(static_cast<const SharedJoint*>(theirs));
    if (joint == nullptr) return false;
    auto& own = copy.shared.emplace<SharedJoint>();
    own.joint = joint->joint;
    own.is_joint = true;
    own.is_given = false;
    copy.sample.shared = &own;
  } else {
    const auto* covariance = forest_.here(static_cast<const SharedCovariance*>(theirs));
    if (covariance == nullptr) return false;
    auto& own = copy.shared.emplace<SharedCovariance>();
    own.covariance = covariance->covariance;
    copy.sample.shared = &own;
    if (!is_set(shared->is_revised)) return true;
    const SharedRevision* revision = forest_.here(RemoteForest::load(covariance->revision));
    SampleRevision read;
    if (revision == nullptr) return false;
    read.given = revision->given;
    read.row.observed = is_set(revision->row.observed);
    read.row.follows = revision->row.follows;
    if (!edge_.read(RemoteForest::load(revision->flat()), read.correlation)) return false;
    own.is_revised = true;
    own.is_given = false;
    own.set_revision(make_in<const SharedRevision>(heap(), std::move(read)));
  }
  return true;
}

bool RemoteSamples::make_whole(SampleHistory::Bracket& samples, Copies& copies) const {
  const Sample* after = samples.after;
  if (!copy(*samples.before, copies.before)) return false;
  const SharedPart* theirs = RemoteForest::load(samples.before->shared);
  samples.before = &copies.before.sample;
  if (after == nullptr) return true;
  copies.after.sample = *after;
  samples.after = &copies.after.sample;
  // Positions of one joint are told by what they share.
  if (copies.after.sample.shared == theirs) {
    copies.after.sample.shared = copies.before.sample.shared;
    return true;
  }
  return copy(*after, copies.after);
}

}  // namespace tfdude
