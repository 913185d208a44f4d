#include "tfdude/client/stream.hpp"

#include "base/stamp.hpp"
#include "math/finite.hpp"
#include "runtime/sender.hpp"

namespace tfdude {

EdgeStream::EdgeStream(std::shared_ptr<Sender<Update>> sender) : sender_(std::move(sender)) {}
EdgeStream::EdgeStream(EdgeStream&&) noexcept = default;
EdgeStream& EdgeStream::operator=(EdgeStream&&) noexcept = default;
EdgeStream::~EdgeStream() = default;

const std::vector<NotSent>& EdgeStream::try_publish(const std::vector<Transform>& X_PC,
                                                    std::optional<Time> stamp) {
  if (X_PC.size() != sender_->size() || !is_stamp(stamp)) {
    return sender_->refuse(Errc::kInvalidInput);
  }
  return sender_->send(
      stamp, [&](std::size_t i) { return is_finite(X_PC[i]); },
      [&](EdgeUpdate& edge, std::size_t i) { edge.X_PC = X_PC[i]; });
}

JointStream::JointStream(std::shared_ptr<Sender<JointUpdate>> sender)
    : sender_(std::move(sender)) {}
JointStream::JointStream(JointStream&&) noexcept = default;
JointStream& JointStream::operator=(JointStream&&) noexcept = default;
JointStream::~JointStream() = default;

const std::vector<NotSent>& JointStream::try_publish(const std::vector<double>& positions,
                                                     const std::vector<double>& variances,
                                                     std::optional<Time> stamp) {
  const bool specified = !variances.empty();
  if (positions.size() != sender_->size() || (specified && variances.size() != sender_->size()) ||
      !is_stamp(stamp)) {
    return sender_->refuse(Errc::kInvalidInput);
  }
  const auto is_valid = [&](std::size_t i) {
    return is_position(positions[i]) && (!specified || is_variance(variances[i]));
  };
  return sender_->send(stamp, is_valid, [&](JointValue& joint, std::size_t i) {
    joint.position = positions[i];
    joint.variance = specified ? std::optional<double>(variances[i]) : std::nullopt;
  });
}

}  // namespace tfdude
