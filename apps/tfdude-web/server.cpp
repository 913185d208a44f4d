#include "server.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <list>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <spdlog/spdlog.h>

// The only part that sees Boost.Beast, which takes long to compile.
namespace tfdude::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostConnections = 64;  // of WebSocket
// Those that have not shown that they may enter have places of their own, and little time.
constexpr std::size_t kMostVisits = 64;
constexpr std::chrono::seconds kStrangersTime{1};
constexpr std::chrono::seconds kPieceTime{2};  // for a client to take some of its answer
constexpr std::size_t kMostMessage = std::size_t{64} << 10U;  // of a client [B]
constexpr std::uint32_t kMostHead = 8192;                     // of a request [B]
// Control messages wait for clients that do not read, until this many bytes do, of one and of all.
constexpr std::size_t kMostWaiting = std::size_t{64} << 20U;
constexpr std::size_t kMostWaitingOfAll = std::size_t{256} << 20U;
constexpr std::chrono::seconds kRequestTime{30};

using Head = http::request<http::empty_body>;

std::string text(beast::string_view view) { return {view.data(), view.size()}; }

Request request_of(const Head& head) {
  const std::string target = text(head.target());
  const std::size_t question = std::min(target.find('?'), target.size());
  return {target.substr(0, question),
          question < target.size() ? target.substr(question + 1) : std::string(),
          text(head[http::field::host]),
          text(head[http::field::origin]),
          text(head[http::field::cookie]),
          text(head[http::field::sec_websocket_protocol])};
}

// The body is not copied: who asks for a large one and does not read it costs nothing.
using Response = http::response<http::span_body<const char>>;

Response response_of(const Reply& reply, const Head& head) {
  Response response(http::int_to_status(reply.status), head.version());
  response.set(http::field::content_type, reply.type);
  response.set(http::field::cache_control, "no-cache");
  response.set("Referrer-Policy", "no-referrer");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("X-Frame-Options", "DENY");
  response.set("Content-Security-Policy",
               "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:");
  if (!reply.set_cookie.empty()) response.set(http::field::set_cookie, reply.set_cookie);
  if (!reply.location.empty()) response.set(http::field::location, reply.location);
  response.keep_alive(head.keep_alive());
  if (reply.body) response.body() = {reply.body->data(), reply.body->size()};
  response.prepare_payload();
  return response;
}

class Connection;
class Visit;

// All that lives as long as the server, on its thread.
struct Shared {
  Site site;
  std::set<std::shared_ptr<Connection>> talking;
  std::size_t open = 0;           // connections
  std::list<Visit*> visits;       // the one for which nothing has moved for longest first
  std::size_t waiting_bytes = 0;  // of all connections
};

// A WebSocket connection.
class Connection final : public Link, public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket&& socket, Shared& shared, Accepted accepted)
      : stream_(std::move(socket)), shared_(shared), accepted_(std::move(accepted)) {
    ++shared_.open;
  }
  ~Connection() override {
    --shared_.open;
    shared_.waiting_bytes -= waiting_;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void run(const Head& head) {
    stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    stream_.read_message_max(kMostMessage);
    stream_.set_option(websocket::stream_base::decorator(
        [protocol = accepted_.protocol](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, protocol);
        }));
    stream_.async_accept(head, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->shared_.talking.insert(self);
      self->accepted_.talk->begin(*self);
      self->read();
    });
  }

  void tick() { accepted_.talk->tick(); }

  void send(std::shared_ptr<const std::string> message, bool binary) override {
    if (closed_) return;
    waiting_ += message->size();
    shared_.waiting_bytes += message->size();
    queue_.emplace_back(std::move(message), binary);
    const bool too_much = shared_.waiting_bytes > kMostWaitingOfAll && waiting_ > kMostWaiting / 64;
    if (waiting_ > kMostWaiting || too_much) {
      end();
    } else if (queue_.size() == 1) {
      write();
    }
  }

  [[nodiscard]] std::size_t waiting() const override { return waiting_; }

  void end() {
    if (closed_) return;
    closed_ = true;
    error_code ignored;
    beast::get_lowest_layer(stream_).socket().close(ignored);
    asio::post(stream_.get_executor(),
               [self = shared_from_this()] { self->shared_.talking.erase(self); });
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->end();
      const auto data = self->buffer_.cdata();
      const std::string_view message(static_cast<const char*>(data.data()), data.size());
      const bool good = self->accepted_.talk->receive(message, self->stream_.got_binary());
      self->buffer_.consume(self->buffer_.size());
      if (good) return self->read();
      self->reject();
    });
  }

  void reject() {
    stream_.async_close(websocket::close_code::bad_payload,
                        [self = shared_from_this()](error_code) { self->end(); });
  }

  void write() {
    stream_.binary(queue_.front().second);
    stream_.async_write(asio::buffer(*queue_.front().first),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          if (error) return self->end();
                          self->waiting_ -= self->queue_.front().first->size();
                          self->shared_.waiting_bytes -= self->queue_.front().first->size();
                          self->queue_.pop_front();
                          if (!self->queue_.empty()) self->write();
                        });
  }

  websocket::stream<beast::tcp_stream> stream_;
  Shared& shared_;
  Accepted accepted_;
  beast::flat_buffer buffer_;
  std::deque<std::pair<std::shared_ptr<const std::string>, bool>> queue_;
  std::size_t waiting_ = 0;
  bool closed_ = false;
};

// A connection before, or without, the upgrade to WebSocket.
class Visit : public std::enable_shared_from_this<Visit> {
 public:
  Visit(tcp::socket&& socket, Shared& shared)
      : stream_(std::move(socket)),
        shared_(shared),
        place_(shared.visits.insert(shared.visits.end(), this)) {}
  ~Visit() { shared_.visits.erase(place_); }
  Visit(const Visit&) = delete;
  Visit& operator=(const Visit&) = delete;

  /// Whether it has only been waited for so far, so that it may make room.
  [[nodiscard]] bool is_stranger() const { return !known_; }

  void close() {
    error_code ignored;
    stream_.socket().close(ignored);
  }

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHead);
    parser_->body_limit(0);
    stream_.expires_after(known_ ? kRequestTime : kStrangersTime);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       if (!error) self->answer();
                     });
  }

 private:
  void answer() {
    const Head& head = parser_->get();
    const Request request = request_of(head);
    if (websocket::is_upgrade(head)) {
      auto accepted = shared_.site.accept(request);
      if (!accepted) return write(accepted.error());
      if (shared_.open >= kMostConnections) {
        return write({503, "text/plain",
                      std::make_shared<const std::string>("there are too many connections\n")});
      }
      stream_.expires_never();
      std::make_shared<Connection>(stream_.release_socket(), shared_, std::move(*accepted))
          ->run(head);
      return;
    }
    if (head.method() != http::verb::get) {
      return write({405, "text/plain", std::make_shared<const std::string>("only GET\n")});
    }
    write(shared_.site.get(request));
  }

  void write(const Reply& reply) {
    constexpr unsigned kFirstError = 400;
    known_ = reply.status < kFirstError;
    body_ = reply.body;
    response_ = response_of(reply, parser_->get());
    serializer_.emplace(*response_);
    end_ = std::chrono::steady_clock::now() + kRequestTime;
    write_piece();
  }

  void write_piece() {
    shared_.visits.splice(shared_.visits.end(), shared_.visits, place_);
    stream_.expires_at(std::min(end_, std::chrono::steady_clock::now() + kPieceTime));
    http::async_write_some(stream_, *serializer_,
                           [self = shared_from_this()](error_code error, std::size_t) {
                             if (error) return;
                             if (!self->serializer_->is_done()) return self->write_piece();
                             self->written();
                           });
  }

  void written() {
    if (!response_->need_eof()) return read();
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  beast::tcp_stream stream_;
  Shared& shared_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  const std::list<Visit*>::iterator place_;
  bool known_ = false;  // its last request was answered with what it asked for
  std::shared_ptr<const std::string> body_;
  std::optional<Response> response_;
  std::optional<http::response_serializer<http::span_body<const char>>> serializer_;
  std::chrono::steady_clock::time_point end_;  // of the time for the answer
};

class BeastServer final : public Server {
 public:
  explicit BeastServer(const std::function<Site(const Post&)>& make_site)
      : acceptor_(context_), timer_(context_) {
    shared_.site = make_site(
        [this](std::function<void()> function) { asio::post(context_, std::move(function)); });
  }
  ~BeastServer() override { stop(); }
  BeastServer(const BeastServer&) = delete;
  BeastServer& operator=(const BeastServer&) = delete;

  Result<void> listen(const ServerSettings& settings) {
    error_code error;
    const auto address = asio::ip::make_address(settings.address, error);
    if (error) return fail(Errc::kInvalidInput, "'" + settings.address + "' is not an address");
    const tcp::endpoint endpoint(address, settings.port);
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      return fail(Errc::kTransport, "cannot listen on " + settings.address + " port " +
                                        std::to_string(settings.port) + ": " + error.message());
    }
    port_ = acceptor_.local_endpoint().port();
    period_ = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / settings.rate));
    next_ = std::chrono::steady_clock::now();
    accept();
    wait();
    thread_ = std::thread([this] { context_.run(); });
    return {};
  }

  [[nodiscard]] std::uint16_t port() const override { return port_; }

  void stop() override {
    if (!thread_.joinable()) return;
    context_.stop();
    thread_.join();
    shared_.talking.clear();
  }

 private:
  void accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && make_room()) {
        socket.set_option(tcp::no_delay(true), error);
        std::make_shared<Visit>(std::move(socket), shared_)->read();
      }
      accept();
    });
  }

  // The stranger that has waited for longest goes first; if there is none, the visit for which
  // nothing has moved for longest: it is idle, or does not read.
  bool make_room() {
    if (shared_.visits.size() < kMostVisits) return true;
    auto last = std::find_if(shared_.visits.begin(), shared_.visits.end(),
                             [](const Visit* visit) { return visit->is_stranger(); });
    if (last == shared_.visits.end()) last = shared_.visits.begin();
    (*last)->close();  // its handler runs later, and deletes it
    shared_.visits.splice(shared_.visits.end(), shared_.visits, last);
    return shared_.visits.size() < 2 * kMostVisits;
  }

  void wait() {
    next_ = std::max(next_ + period_, std::chrono::steady_clock::now());
    timer_.expires_at(next_);
    timer_.async_wait([this](error_code error) {
      if (error) return;
      shared_.site.tick();
      const std::set<std::shared_ptr<Connection>> all = shared_.talking;
      for (const auto& connection : all) connection->tick();
      wait();
    });
  }

  // Connections count themselves there when they end, so it outlives the context, which has them.
  Shared shared_;
  asio::io_context context_;
  tcp::acceptor acceptor_;
  asio::steady_timer timer_;
  std::chrono::steady_clock::time_point next_;
  std::chrono::nanoseconds period_{0};
  std::uint16_t port_ = 0;
  std::thread thread_;
};

}  // namespace

Result<std::unique_ptr<Server>> Server::open(const ServerSettings& settings,
                                             const std::function<Site(const Post&)>& make_site) {
  auto server = std::make_unique<BeastServer>(make_site);
  if (auto listening = server->listen(settings); !listening) {
    return tl::unexpected(listening.error());
  }
  return std::unique_ptr<Server>(std::move(server));
}

}  // namespace tfdude::web
