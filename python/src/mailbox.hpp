#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include <pybind11/pybind11.h>

namespace tfdude::python {

namespace py = pybind11;

/// What threads of the library leave for a thread of Python, which is woken by a file descriptor:
/// so they never need the GIL, and asyncio's loop needs no other thread.
class Mailbox {
 public:
  /// Makes an object of Python, with the GIL, when it is taken.
  using Item = std::function<py::object()>;

  Mailbox();
  ~Mailbox();
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  // From any thread.
  void put(Item item);
  /// Wakes without an item; several are one.
  void wake();
  /// Wakes, and says that nothing more will come.
  void end();

  // With the GIL.
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool ended() const;
  /// All items. The descriptor is not readable afterwards, unless nothing more will come.
  [[nodiscard]] py::list take();

 private:
  const int fd_;
  mutable std::mutex mutex_;
  std::deque<Item> items_;
  bool awake_ = false;  // the descriptor is readable
  bool ended_ = false;
};

using MailboxPtr = std::shared_ptr<Mailbox>;

/// The mailboxes that get nothing more once a client is closed.
class Endings {
 public:
  /// If the client is closed already, the mailbox ends at once.
  void add(const MailboxPtr& mailbox);
  void end_all();

 private:
  std::mutex mutex_;
  std::vector<std::weak_ptr<Mailbox>> mailboxes_;
  bool ended_ = false;
};

}  // namespace tfdude::python
