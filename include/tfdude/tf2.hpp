#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/frame_source.hpp"
#include "tfdude/client/tf2_messages.hpp"

// tf2's buffer for nodes that are written for it: header only, and without ROS.
// docs/coming-from-tf2.md says which two lines of a node change, and what differs.
namespace tfdude::tf2_ros {

/// tf2_ros's buffer. All functions may be called from any thread, of a recording by one at a time.
/// They ask the owners of frames, so nothing has to be filled, and no listener is needed.
class Buffer {
 public:
  /// Joins the domain of the environment (Options). @throws tf2::TransformException
  Buffer() {
    auto opened = Client::open();
    if (!opened) tf2::detail::raise(opened.error());
    own_ = std::make_unique<Client>(*std::move(opened));
    client_ = own_.get();
    adapter_ = std::make_unique<ClientSource>(*client_);
    source_ = adapter_.get();
  }
  /// The same; a clock, a node or the time for which tf2 keeps transforms is not used.
  template <class First, class... More,
            class = std::enable_if_t<!std::is_base_of_v<FrameSource, First> &&
                                     !std::is_base_of_v<Client, First>>>
  explicit Buffer(const First& /*first*/, const More&... /*more*/) : Buffer() {}
  /// Asks a client, or any other source, which must outlive this.
  explicit Buffer(Client& client)
      : client_(&client),
        adapter_(std::make_unique<ClientSource>(client)),
        source_(adapter_.get()) {}
  explicit Buffer(FrameSource& source) : source_(&source) {}

  /// X_target_source.
  /// @param time  of tf2, ROS 1 or ROS 2; zero: the newest
  /// @param timeout  for missing frames and data
  /// @throws tf2::TransformException, one of its subclasses
  template <class T, class D = tf2::Duration>
  [[nodiscard]] tf2::TransformStamped lookupTransform(const std::string& target,
                                                      const std::string& source, const T& time,
                                                      const D& timeout = {}) const {
    const tf2::Duration at = tf2::detail::nanoseconds_of(time);
    const auto X = look_up(target, source, at, tf2::detail::nanoseconds_of(timeout));
    if (!X) tf2::detail::raise(X.error());
    return message(target, source, *X, Time(at));
  }

  /// The same with two times, through a frame that does not move between them. The stamp is that of
  /// the target.
  template <class T, class S, class D = tf2::Duration>
  [[nodiscard]] tf2::TransformStamped lookupTransform(
      const std::string& target, const T& target_time, const std::string& source,
      const S& source_time, const std::string& fixed, const D& timeout = {}) const {
    const tf2::Duration wait = tf2::detail::nanoseconds_of(timeout);
    Query at_target = query(tf2::detail::nanoseconds_of(target_time));
    const Query at_source = query(tf2::detail::nanoseconds_of(source_time));
    if (!at_target.at) {
      const auto newest = look_up(target, fixed, tf2::Duration(0), wait);
      if (!newest) tf2::detail::raise(newest.error());
      at_target.at = newest->stamp;
    }
    auto X = look_up_over(target, at_target, source, at_source, fixed, wait);
    if (!X) tf2::detail::raise(X.error());
    X->stamp = at_target.at;
    return message(target, source, *X, Time());
  }

  template <class T, class D = tf2::Duration>
  [[nodiscard]] bool canTransform(const std::string& target, const std::string& source,
                                  const T& time, const D& timeout = {},
                                  std::string* error = nullptr) const {
    const auto X = look_up(target, source, tf2::detail::nanoseconds_of(time),
                           tf2::detail::nanoseconds_of(timeout));
    if (!X && error != nullptr) *error = X.error().message;
    return X.has_value();
  }
  template <class T>
  [[nodiscard]] bool canTransform(const std::string& target, const std::string& source,
                                  const T& time, std::string* error) const {
    return canTransform(target, source, time, tf2::Duration(), error);
  }
  /// The same with two times, as lookupTransform().
  template <class T, class S, class D = tf2::Duration>
  [[nodiscard]] bool canTransform(const std::string& target, const T& target_time,
                                  const std::string& source, const S& source_time,
                                  const std::string& fixed, const D& timeout = {},
                                  std::string* error = nullptr) const {
    const auto X = look_up_over(target, query(tf2::detail::nanoseconds_of(target_time)), source,
                                query(tf2::detail::nanoseconds_of(source_time)), fixed,
                                tf2::detail::nanoseconds_of(timeout));
    if (!X && error != nullptr) *error = X.error().message;
    return X.has_value();
  }
  template <class T, class S>
  [[nodiscard]] bool canTransform(const std::string& target, const T& target_time,
                                  const std::string& source, const S& source_time,
                                  const std::string& fixed, std::string* error) const {
    return canTransform(target, target_time, source, source_time, fixed, tf2::Duration(), error);
  }

  /// A message with a header, in another frame, at its own stamp. @throws as lookupTransform()
  template <class Message, class D = tf2::Duration>
  Message& transform(const Message& in, Message& out, const std::string& target,
                     const D& timeout = {}) const {
    tf2::doTransform(in, out,
                     lookupTransform(target, in.header.frame_id, in.header.stamp, timeout));
    return out;
  }
  template <class Message, class D = tf2::Duration>
  [[nodiscard]] Message transform(const Message& in, const std::string& target,
                                  const D& timeout = {}) const {
    Message out;
    return transform(in, out, target, timeout);
  }
  template <class Message, class T, class D = tf2::Duration>
  Message& transform(const Message& in, Message& out, const std::string& target,
                     const T& target_time, const std::string& fixed, const D& timeout = {}) const {
    tf2::doTransform(
        in, out,
        lookupTransform(target, target_time, in.header.frame_id, in.header.stamp, fixed, timeout));
    return out;
  }
  template <class Message, class T, class D = tf2::Duration>
  [[nodiscard]] Message transform(const Message& in, const std::string& target,
                                  const T& target_time, const std::string& fixed,
                                  const D& timeout = {}) const {
    Message out;
    return transform(in, out, target, target_time, fixed, timeout);
  }

  [[nodiscard]] std::vector<std::string> getAllFrameNames() const {
    const auto frames = source_->frames();
    if (!frames) tf2::detail::raise(frames.error());
    std::vector<std::string> names;
    for (const Frame& frame : *frames) names.push_back(frame.id);
    return names;
  }
  [[nodiscard]] bool _frameExists(const std::string& frame) const {
    if (client_ != nullptr) return client_->exists(name(frame));
    const auto names = getAllFrameNames();
    return std::find(names.begin(), names.end(), name(frame)) != names.end();
  }

  // What a node tells tf2 about its executor: there is nothing to spin.
  void setUsingDedicatedThread(bool /*value*/) {}
  template <class Interface>
  void setCreateTimerInterface(const Interface& /*timers*/) {}
  void clear() {}

 private:
  /// ROS 1 had a leading slash, and some nodes still do.
  [[nodiscard]] static std::string name(const std::string& frame) {
    const std::size_t begin = frame.find_first_not_of('/');
    return begin == std::string::npos ? std::string() : frame.substr(begin);
  }
  [[nodiscard]] static Error no_frame() { return {Errc::kInvalidInput, "an empty frame id"}; }
  [[nodiscard]] static Query query(tf2::Duration at) {
    Query query;
    if (at.count() != 0) query.at = Time(at);
    return query;
  }
  [[nodiscard]] static Milliseconds milliseconds(tf2::Duration timeout) {
    return std::chrono::ceil<Milliseconds>(std::max(timeout, tf2::Duration()));
  }

  [[nodiscard]] Result<StampedTransform> look_up(const std::string& target,
                                                 const std::string& source, tf2::Duration at,
                                                 tf2::Duration timeout) const {
    const std::string a = name(target);
    const std::string b = name(source);
    if (a.empty() || b.empty()) return tl::unexpected(no_frame());
    return source_->lookup(a, b, query(at), milliseconds(timeout));
  }

  [[nodiscard]] Result<StampedTransform> look_up_over(
      const std::string& target, const Query& at_target, const std::string& source,
      const Query& at_source, const std::string& fixed, tf2::Duration timeout) const {
    const std::string a = name(target);
    const std::string b = name(source);
    const std::string c = name(fixed);
    if (a.empty() || b.empty() || c.empty()) return tl::unexpected(no_frame());
    return source_->lookup_over(a, at_target, b, at_source, c, milliseconds(timeout));
  }

  // A static transform holds for the time that was asked for.
  [[nodiscard]] static tf2::TransformStamped message(const std::string& target,
                                                     const std::string& source,
                                                     const StampedTransform& X, Time asked) {
    tf2::TransformStamped message;
    tf2::detail::set_stamp(message.header.stamp, X.stamp.value_or(asked));
    message.header.frame_id = name(target);
    message.child_frame_id = name(source);
    tf2::detail::set_vector(message.transform.translation, X.pose.translation());
    tf2::detail::set_rotation(message.transform.rotation, X.pose.rotation());
    message.covariance = X.covariance;
    return message;
  }

  std::unique_ptr<Client> own_;
  Client* client_ = nullptr;
  std::unique_ptr<FrameSource> adapter_;
  FrameSource* source_ = nullptr;
};

/// Does nothing: a buffer asks owners.
class TransformListener {
 public:
  template <class... Any>
  explicit TransformListener(const Buffer& /*buffer*/, const Any&... /*more*/) {}
};

}  // namespace tfdude::tf2_ros
