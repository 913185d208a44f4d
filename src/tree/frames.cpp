#include "tree/frames.hpp"

#include "tfdude/base/id.hpp"

namespace tfdude {

tl::unexpected<Error> unknown_start(std::string_view id) {
  return fail_about_frame(Errc::kUnknownStart, "no frame " + quote(id) + " to start from", id);
}

tl::unexpected<Error> unknown_end(std::string_view id) {
  return fail_about_frame(Errc::kUnknownEnd, "no frame " + quote(id) + " to end at", id);
}

namespace {

// A root, or a frame whose parent does not exist.
const Version& top_above(const Version& frame, std::uint64_t commit) {
  const Version* top = &frame;
  while (top->depth > 0) top = Frames::at(*top->above, commit);
  return *top;
}

}  // namespace

tl::unexpected<Error> not_connected(const Ends& ends) {
  const auto& [a, b, commit] = ends;
  auto failed = fail_about_frame(
      Errc::kNotConnected,
      "frames " + quote(a->name->text) + " and " + quote(b->name->text) + " have no common root",
      a->name->text);
  for (const Version* end : {a, b}) {
    const Version& top = top_above(*end, commit);
    if (top.above == nullptr) continue;
    Error& error = failed.value();
    error.frame = Frames::at(*top.above, commit)->name->text;
    error.message += ": frame " + quote(top.name->text) + " waits for its parent " +
                     quote(error.frame) + ", which does not exist";
    break;
  }
  return failed;
}

const Version* Frames::named(std::string_view id, std::uint64_t commit) const {
  const Name* name = ids_.find(id);
  if (name == nullptr) return nullptr;
  const Version* version = at(name->slot, commit);
  return version->name == name ? version : nullptr;
}

const Version* Frames::of(Handle frame, std::uint64_t commit) const {
  if (frame.slot >= slots_.size()) return nullptr;
  const Version* version = at(frame.slot, commit);
  return version->present() && version->generation == frame.generation ? version : nullptr;
}

Result<Ends> Frames::ends(std::string_view a, std::string_view b) const {
  const std::uint64_t commit = snapshot();
  const Version* start = present(a, commit);
  if (start == nullptr) return unknown_start(a);
  const Version* end = present(b, commit);
  if (end == nullptr) return unknown_end(b);
  return Ends{start, end, commit};
}

Result<Ends> Frames::ends(Handle a, Handle b) const {
  const std::uint64_t commit = snapshot();
  const Version* start = of(a, commit);
  if (start == nullptr)
    return fail(Errc::kUnknownStart,
                "the first frame was removed, or its handle is another client's");
  const Version* end = of(b, commit);
  if (end == nullptr)
    return fail(Errc::kUnknownEnd,
                "the second frame was removed, or its handle is another client's");
  return Ends{start, end, commit};
}

Result<const HeldVersion*> Frames::held_value(std::string_view id) const {
  const Version* version = present(id, snapshot());
  if (version == nullptr) {
    return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
  }
  if (!version->held()) {
    return fail(Errc::kNotOwner, "frame " + quote(id) + " is owned by another partition");
  }
  return static_cast<const HeldVersion*>(version);
}

FrameInfo Frames::info_of(const Version& version, std::uint64_t commit) const {
  FrameInfo info;
  info.id = version.name->text;
  info.owner = version.owner;
  info.lamport_time = version.name->lamport_time.load(std::memory_order_relaxed);
  if (version.parent != kNoSlot) {
    const Version* parent = at(version.parent, commit);
    info.parent = parent->name->text;
    info.attached = parent->present();
  }
  return info;
}

const Version* Frames::newest_named(std::string_view id) const {
  const Name* name = ids_.find(id);
  return name != nullptr ? &newest(name->slot) : nullptr;
}

Result<std::uint32_t> Frames::held_slot(std::string_view id) const {
  const Version* version = newest_named(id);
  if (version == nullptr || !version->present()) {
    return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
  }
  if (!version->held()) {
    return fail(Errc::kNotOwner, "frame " + quote(id) + " is owned by another partition");
  }
  return version->slot;
}

Result<std::uint32_t> Frames::held_slot(Handle frame) const {
  const Version* version = frame.slot < slots_.size() ? &newest(frame.slot) : nullptr;
  if (version == nullptr || !version->present() || version->generation != frame.generation) {
    return fail(Errc::kUnknownFrame,
                "the frame of this handle was removed, or is another client's");
  }
  if (!version->held()) {
    return fail(Errc::kNotOwner,
                "frame " + quote(version->name->text) + " is owned by another partition");
  }
  return frame.slot;
}

}  // namespace tfdude
