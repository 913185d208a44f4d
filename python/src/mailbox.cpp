#include "mailbox.hpp"

#include <algorithm>
#include <cstdint>
#include <sys/eventfd.h>
#include <unistd.h>
#include <utility>

#include "session.hpp"

namespace tfdude::python {

Mailbox::Mailbox() : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ >= 0) return;
  PyErr_SetFromErrno(PyExc_OSError);
  throw py::error_already_set();
}

Mailbox::~Mailbox() { close(fd_); }

void Mailbox::put(Item item) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    items_.push_back(std::move(item));
  }
  wake();
}

void Mailbox::wake() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (awake_) return;
  const std::uint64_t one = 1;
  awake_ = write(fd_, &one, sizeof one) == sizeof one;
}

void Mailbox::end() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ended_ = true;
  }
  wake();
}

bool Mailbox::ended() const {
  check_usable();
  const std::lock_guard<std::mutex> lock(mutex_);
  return ended_;
}

py::list Mailbox::take() {
  check_usable();
  std::deque<Item> items;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    items.swap(items_);
    std::uint64_t count = 0;
    if (awake_ && !ended_) awake_ = read(fd_, &count, sizeof count) != sizeof count;
  }
  py::list taken;
  for (const Item& item : items) taken.append(item());
  return taken;
}

void Endings::add(const MailboxPtr& mailbox) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ended_) mailbox->end();
  mailboxes_.erase(std::remove_if(mailboxes_.begin(), mailboxes_.end(),
                                  [](const auto& one) { return one.expired(); }),
                   mailboxes_.end());
  mailboxes_.push_back(mailbox);
}

void Endings::end_all() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ended_ = true;
  for (const auto& one : mailboxes_) {
    if (const MailboxPtr mailbox = one.lock()) mailbox->end();
  }
}

}  // namespace tfdude::python
