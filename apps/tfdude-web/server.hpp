#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"

// HTTP and WebSocket on one port. What is served, and to whom, is decided elsewhere (site.hpp).
namespace tfdude::web {

/// The head of a request, as far as it matters.
struct Request {
  std::string path;   ///< without the query
  std::string query;  ///< after the '?'
  std::string host;
  std::string origin;  ///< empty: the client is no page
  std::string cookie;
  std::string protocols;  ///< subprotocols that a WebSocket client offers
};

struct Reply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body;
  std::string set_cookie{};
  std::string location{};
};

/// The server's end of one WebSocket connection. To be used on the server's thread only.
class Link {
 public:
  Link() = default;
  virtual ~Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Sends after what is being sent.
  virtual void send(std::shared_ptr<const std::string> message, bool binary) = 0;
  /// Bytes that the client has not taken yet.
  [[nodiscard]] virtual std::size_t waiting() const = 0;
};

/// What is said over one connection. All functions are called on the server's thread.
class Talk {
 public:
  Talk() = default;
  virtual ~Talk() = default;
  Talk(const Talk&) = delete;
  Talk& operator=(const Talk&) = delete;

  /// Called once, first.
  virtual void begin(Link& link) = 0;
  /// @return false: the message is malformed, and the connection is closed
  [[nodiscard]] virtual bool receive(std::string_view message, bool binary) = 0;
  /// Called with each picture.
  virtual void tick() = 0;
};

/// A talk in the subprotocol that was chosen.
struct Accepted {
  std::string protocol;
  std::unique_ptr<Talk> talk;
};

struct Site {
  std::function<Reply(const Request&)> get;
  /// A reply: the connection is rejected with it.
  std::function<tl::expected<Accepted, Reply>(const Request&)> accept;
  /// Called before the talks' tick().
  std::function<void()> tick;
};

/// Runs a function on the server's thread; from any thread.
using Post = std::function<void(std::function<void()>)>;

struct ServerSettings {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8765;
  double rate = 30;  ///< of tick() [Hz]
};

/// Serves on a thread of its own while it exists.
class Server {
 public:
  /// @param make_site  gets what talks may use until the server is destroyed
  /// @return kInvalidInput (the address), kTransport (the port is taken).
  [[nodiscard]] static Result<std::unique_ptr<Server>> open(
      const ServerSettings& settings, const std::function<Site(const Post&)>& make_site);
  virtual ~Server() = default;
  Server() = default;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The port, also if it was given as 0.
  [[nodiscard]] virtual std::uint16_t port() const = 0;
  /// Closes all connections and waits for the thread. No function is called afterwards.
  virtual void stop() = 0;
};

}  // namespace tfdude::web
