#include "pairs.hpp"

#include <nlohmann/json.hpp>

#include "../rendering/explanation.hpp"
#include "../rendering/json.hpp"
#include "told.hpp"

namespace tfdude::web {
namespace {

// After so long an answer is made again without news of the path: an owner may have died.
constexpr std::chrono::milliseconds kRenewed{500};

}  // namespace

std::shared_ptr<Pair> Pairs::follow(const std::string& a, const std::string& b) {
  auto& known = pairs_[{a, b}];
  auto pair = known.lock();
  if (!pair) {
    pair = std::make_shared<Pair>(a, b);
    known = pair;
    renew(*pair);
    begin(pair);
  }
  return pair;
}

void Pairs::begin(const std::shared_ptr<Pair>& pair) {
  {
    const std::lock_guard<std::mutex> lock(pair->mutex_);
    if (pair->watch_ || pair->asked_) return;
    pair->asked_ = true;
  }
  const bool posted = worker_.post([this, pair] {
    WatchOptions options;
    options.rate = rate_;
    auto watch = client_.watch(pair->a(), pair->b(), options);
    const std::lock_guard<std::mutex> lock(pair->mutex_);
    if (watch) {
      pair->watch_ = *std::move(watch);
    } else {
      pair->error_ = watch.error();
    }
    pair->asked_ = false;
  });
  if (posted) return;
  const std::lock_guard<std::mutex> lock(pair->mutex_);
  pair->asked_ = false;
}

void Pairs::tick() {
  for (auto known = pairs_.begin(); known != pairs_.end();) {
    const auto pair = known->second.lock();
    if (!pair) {
      known = pairs_.erase(known);
      continue;
    }
    renew(*pair);
    if (std::chrono::steady_clock::now() >= pair->next_) {
      pair->next_ = std::chrono::steady_clock::now() + kRenewed;
      begin(pair);
    }
    ++known;
  }
}

void Pairs::renew(Pair& pair) {
  std::optional<PathWatch> watch;
  Error error{Errc::kNotYet, "its owners are asked"};
  {
    const std::lock_guard<std::mutex> lock(pair.mutex_);
    watch = pair.watch_;
    if (pair.error_) error = *pair.error_;
  }
  const std::optional<std::uint64_t> messages =
      watch ? std::optional<std::uint64_t>(watch->messages()) : std::nullopt;
  const auto now = std::chrono::steady_clock::now();
  if (messages == pair.seen_ && pair.answer_ && now < pair.next_) return;
  pair.seen_ = messages;
  const auto X_AB =
      watch ? watch->latest() : Result<StampedTransform>(tl::unexpected(std::move(error)));
  // The last values hold on while an owner is not reachable; the command line gets an error then.
  const auto health = watch ? watch->health() : Result<void>();
  const std::string why = health ? std::string() : health.error().message;
  const Text answer = text_of(pair.a(), pair.b(), X_AB, false, why);
  if (pair.answer_ && *pair.answer_ == *answer) return;
  pair.answer_ = answer;
  ++pair.number_;
}

void Pairs::each(const std::function<void(const Pair&)>& see) const {
  for (const auto& [ends, known] : pairs_) {
    if (const auto pair = known.lock()) see(*pair);
  }
}

Text Pairs::answer_at(const std::string& a, const std::string& b, Time instant) const {
  Query query;
  query.at = instant;
  return text_of(a, b, client_.lookup(a, b, query), true, {});
}

Text Pairs::explained(const std::string& a, const std::string& b,
                      const std::optional<Time>& instant) const {
  WhyQuery query;
  query.at = instant;
  nlohmann::json json = cli::why_json(a, b, client_.why(a, b, query));
  json["op"] = "why";
  return std::make_shared<const std::string>(cli::dump(json));
}

Text Pairs::text_of(const std::string& a, const std::string& b,
                    const Result<StampedTransform>& X_AB, bool past,
                    const std::string& unreachable) const {
  const auto path = client_.path(a, b).value_or(std::vector<PathSegment>());
  return std::make_shared<const std::string>(pair_text(a, b, X_AB, path, past, unreachable));
}

}  // namespace tfdude::web
