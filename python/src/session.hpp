#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "tfdude/client/node.hpp"

#include "arguments.hpp"
#include "mailbox.hpp"

// How the library's threads, the GIL, the end of the interpreter and fork() get along.
namespace tfdude::python {

/// Counts what is under way in the library, or in a callback from it: at exit the interpreter waits
/// for it, because a thread that returns to an interpreter that has ended is killed.
class UnderWay {
 public:
  UnderWay();
  ~UnderWay();
  UnderWay(const UnderWay&) = delete;
  UnderWay& operator=(const UnderWay&) = delete;
};

/// Whether the interpreter ends: nothing new begins, and what waits stops waiting.
[[nodiscard]] bool exiting();

/// Called by atexit: closes all clients, and waits until nothing is under way. Needs the GIL, and
/// releases it meanwhile.
void finish();

/// For the child of a fork: a process that has used tfdude before cannot use it after.
/// @throws TransformException (code "transport") in such a child; SystemExit while the interpreter
///   ends
void check_usable();
/// Notes that threads of the library may exist from now on.
void note_use();
[[nodiscard]] bool is_forked_child();

/// Runs a function without the GIL. It must not touch Python.
template <class Function>
auto without_gil(const Function& function) {
  const UnderWay under_way;
  const py::gil_scoped_release release;
  return function();
}

/// Calls a Python function from a thread of the library: takes the GIL, and reports an exception as
/// one that cannot be raised. Does nothing while the interpreter ends.
void call_python(const py::function& function, const std::function<py::object()>& argument);

/// A reference to a Python function that may be dropped by any thread.
using SharedFunction = std::shared_ptr<py::function>;
[[nodiscard]] SharedFunction share(py::function function);

/// What a call or a wait ends with once its client is closed.
[[nodiscard]] Error closed_error();

/// An open Client or Node, for the Python object of the same name. It can be closed while other
/// threads call it; their waits end, and they finish first.
class Session {
 public:
  /// @param partition  of a Node
  Session(std::shared_ptr<Client> client, Milliseconds timeout, std::string partition = {});
  ~Session() { close(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Closing waits for callbacks, which need the GIL: so this releases it.
  void close();
  [[nodiscard]] bool closed() const { return client_ == nullptr; }
  [[nodiscard]] Milliseconds timeout() const { return timeout_; }
  /// Of a Node; else empty.
  [[nodiscard]] const std::string& partition() const { return partition_; }
  /// Of mailboxes that end when this is closed.
  [[nodiscard]] const std::shared_ptr<Endings>& endings() const { return endings_; }

  /// @throws TransformException if it is closed, or was opened before a fork
  [[nodiscard]] std::shared_ptr<Client> client() const;

  /// Calls `function(client)` without the GIL. If the client was closed meanwhile, it ends here,
  /// still without the GIL.
  template <class Function>
  auto call(const Function& function) const {
    std::shared_ptr<Client> client = this->client();
    auto answer = without_gil([&] {
      auto result = function(*client);
      client.reset();
      return result;
    });
    if (closed()) say_closed(answer);
    return answer;
  }

 private:
  /// A wait that has ended with the client says so in the same words, whatever it waited for.
  template <class T>
  static void say_closed(Result<T>& result) {
    const bool ended = !result && result.error().code == Errc::kTransport;
    if (ended) result = tl::unexpected(closed_error());
  }
  template <class T>
  static void say_closed(T&) {}

  std::shared_ptr<Client> client_;  // guarded by the GIL
  Milliseconds timeout_;
  std::string partition_;
  std::shared_ptr<Endings> endings_ = std::make_shared<Endings>();
};

/// Something that, while it exists, lets the library call a function: ending it waits for a call
/// under way, which may need the GIL.
template <class Token>
class Ending {
 public:
  explicit Ending(Token token) : token_(std::make_unique<Token>(std::move(token))) {}
  ~Ending() { end(); }
  Ending(const Ending&) = delete;
  Ending& operator=(const Ending&) = delete;
  void end() {
    std::unique_ptr<Token> token = std::move(token_);
    if (!token) return;
    if (is_forked_child()) {
      static_cast<void>(token.release());  // its threads are not there to end it
      return;
    }
    without_gil([&] { token.reset(); });
  }

 private:
  std::unique_ptr<Token> token_;
};

/// The Python class Node: a Session whose client is a Node.
class NodeSession : public Session {
 public:
  using Session::Session;
  template <class Function>
  auto call_node(const Function& function) const {
    return call([&](Client& client) { return function(static_cast<Node&>(client)); });
  }
};

}  // namespace tfdude::python
