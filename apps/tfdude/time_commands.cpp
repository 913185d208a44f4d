#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "tfdude/base/id.hpp"

#include "commands.hpp"
#include "joint_render.hpp"
#include "render.hpp"
#include "screen.hpp"
#include "time_render.hpp"
#include "uncertainty_render.hpp"

// Commands for stamps, histories and followed paths.
namespace tfdude::cli {
namespace {

std::chrono::nanoseconds from_milliseconds(double milliseconds) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(milliseconds * 1e6));
}

Result<Query> query_of(Source source, const std::string& stamp, const Arguments& arguments) {
  Query query;
  const auto at = optional_stamp(source, stamp);
  if (!at) return tl::unexpected(at.error());
  query.at = *at;
  query.extrapolate = from_milliseconds(arguments.extrapolate_ms);
  if (arguments.age_noise) {
    const auto now = source.present();
    if (!now) return tl::unexpected(now.error());
    query.age_noise_until = *now;
  }
  query.order = order_of(arguments);
  return query;
}

Result<StampedTransform> look_up(Source source, const Arguments& arguments) {
  const auto at = query_of(source, arguments.stamp, arguments);
  if (!at) return tl::unexpected(at.error());
  if (!arguments.fixed.empty()) {
    const auto other = query_of(source, arguments.other_stamp, arguments);
    if (!other) return tl::unexpected(other.error());
    return source.lookup(arguments.id, *at, arguments.other, *other, arguments.fixed);
  }
  const Milliseconds wait(static_cast<long>(arguments.wait_ms));
  if (wait.count() == 0) return source.lookup(arguments.id, arguments.other, *at);
  return source.lookup(arguments.id, arguments.other, *at, wait);
}

// Calls show() with the path's newest transform at the rate, until interrupted. If the path cannot
// be watched, or an owner is unreachable, it reports that instead, each reason once.
template <class Show>
int follow(Client& client, const Arguments& arguments, Show show) {
  std::optional<PathWatch> path;
  WatchOptions options;
  options.rate = arguments.rate;
  options.composed = arguments.composed;
  std::optional<Error> reported;
  const auto complain = [&](const Error& error) {
    const bool again =
        reported && reported->code == error.code && reported->message == error.message;
    if (!again) (void)report(error, arguments);
    reported = error;
  };
  do {
    if (!path) {
      auto watched = client.watch(arguments.id, arguments.other, options);
      if (watched) {
        path = *std::move(watched);
      } else {
        complain(cause_of(client, watched.error(), arguments));
        continue;
      }
    }
    if (const auto health = path->health(); !health) {
      complain(health.error());
      continue;
    }
    const auto X_AB = path->latest();
    if (X_AB) {
      show(*X_AB);
      reported.reset();
    } else {
      complain(X_AB.error());
    }
  } while (!interrupted_within(1.0 / arguments.rate));
  return kDone;
}

// Reads seconds with an exponent. The 64 bits of a long double's mantissa are enough for a stamp.
std::optional<std::int64_t> nanoseconds_of_power(const std::string& text) {
  char* end = nullptr;
  const long double ns = std::strtold(text.c_str(), &end) * 1e9L;
  const bool whole = end == text.c_str() + text.size();
  constexpr long double kLast = 9223372036854775807.0L;
  if (!whole || !(ns >= 0 && ns <= kLast)) return std::nullopt;
  return std::llround(ns);
}

}  // namespace

// Does not convert to double, which would round a current stamp to a quarter of a microsecond.
Result<Time> parse_stamp(const std::string& text, Time now) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  constexpr std::size_t kDigits = 9;
  const auto bad = [&] {
    return fail(Errc::kInvalidInput,
                quote(text) +
                    " is not a stamp: decimal seconds since the epoch or, where "
                    "negative, before now");
  };
  const bool before_now = !text.empty() && text[0] == '-';
  const std::string digits = text.substr(before_now ? 1 : 0);
  const auto stamp_of = [&](std::int64_t ns) -> Result<Time> {
    const Time stamp = before_now ? now - std::chrono::nanoseconds(ns) : time_of(ns);
    if (nanoseconds(stamp) < 0) return bad();
    return stamp;
  };
  if (digits.find_first_of("eE") != std::string::npos &&
      std::isdigit(static_cast<unsigned char>(digits[0])) != 0) {
    const auto ns = nanoseconds_of_power(digits);
    if (!ns) return bad();
    return stamp_of(*ns);
  }
  const std::size_t point = std::min(digits.find('.'), digits.size());
  const std::string whole = digits.substr(0, point);
  std::string fraction = point < digits.size() ? digits.substr(point + 1) : "";
  const auto all_digits = [](const std::string& part) {
    return std::all_of(part.begin(), part.end(), [](unsigned char c) { return std::isdigit(c); });
  };
  if (whole.size() + fraction.size() == 0 || whole.size() > kDigits + 1) return bad();
  if (!all_digits(whole) || !all_digits(fraction)) return bad();
  fraction.resize(kDigits, '0');
  const std::int64_t seconds = whole.empty() ? 0 : std::stoll(whole);
  if (seconds > INT64_MAX / kSecond - 1) return bad();
  return stamp_of(seconds * kSecond + std::stoll(fraction));
}

Result<std::optional<Time>> optional_stamp(Source source, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto now = text[0] == '-' ? source.now() : Result<Time>();
  if (!now) return tl::unexpected(now.error());
  return parse_stamp(text, *now).map([](Time stamp) { return std::optional<Time>(stamp); });
}

std::optional<Time> present(Source source, const Arguments& arguments, const std::string& a,
                            const std::string& b) {
  const auto path = source.path(a, b);
  const bool same = path && std::all_of(path->begin(), path->end(), [&](const PathSegment& one) {
                      return !one.clock || *one.clock == arguments.options.clock;
                    });
  const auto now = same ? source.present() : fail(Errc::kInvalidInput, "the clocks differ");
  return now ? std::optional<Time>(*now) : std::nullopt;
}

std::optional<Time> present(Source source, const Arguments& arguments,
                            const PartitionInfo& partition) {
  if (partition.clock && *partition.clock != arguments.options.clock) return std::nullopt;
  const auto now = source.present();
  return now ? std::optional<Time>(*now) : std::nullopt;
}

std::string stamp_line(Source source, const Arguments& arguments, Time stamp) {
  if (!source.live()) return describe_recorded_stamp(stamp, source.end_for(stamp));
  return describe_stamp(stamp, present(source, arguments, arguments.id, arguments.other));
}

Order order_of(const Arguments& arguments) {
  return arguments.order == 4 ? Order::kFourth : Order::kSecond;
}

Shown shown_by(const Arguments& arguments) {
  return {arguments.angles, arguments.covariance, arguments.matrix};
}

nlohmann::json path_json(Source source, const Arguments& arguments, const StampedTransform& X_AB) {
  std::vector<std::string> partitions;
  if (const auto path = source.path(arguments.id, arguments.other)) {
    for (const PathSegment& segment : *path) partitions.push_back(segment.partition);
  }
  auto json = lookup_json(arguments.id, arguments.other, X_AB, partitions);
  add_stamp(json, X_AB.stamp);
  json["basis"] = basis_json(X_AB.basis);
  if (arguments.matrix) json["matrix"] = matrix_json(X_AB.pose.matrix());
  return json;
}

// Redraws what `lookup` prints. The owners push it.
int follow_lookup(Client& client, const Arguments& arguments) {
  Screen screen;
  return follow(client, arguments, [&](const StampedTransform& X_AB) {
    if (arguments.json) {
      (void)answer(arguments, path_json(client, arguments, X_AB), "");
      return;
    }
    const auto now = present(client, arguments, arguments.id, arguments.other);
    std::string text = arguments.other + " in " + arguments.id + "\n" +
                       describe(X_AB, shown_by(arguments), X_AB.basis.unspecified);
    if (X_AB.stamp) text += describe_stamp(*X_AB.stamp, now);
    screen.redraw(text + describe(X_AB.basis));
  });
}

int run_lookup(Source source, const Arguments& arguments) {
  const auto X_AB = look_up(source, arguments);
  if (!X_AB) return refuse(source, X_AB.error(), arguments);
  std::string text = describe(*X_AB, shown_by(arguments), X_AB->basis.unspecified);
  if (X_AB->stamp && !arguments.json) {
    text += stamp_line(source, arguments, *X_AB->stamp);
  }
  text += describe(X_AB->basis);
  return answer(arguments, arguments.json ? path_json(source, arguments, *X_AB) : nlohmann::json(),
                text);
}

int run_velocity(Client& client, const Arguments& arguments) {
  const auto at = optional_stamp(client, arguments.stamp);
  if (!at) return refuse(client, at.error(), arguments);
  const VelocityQuery query{*at, from_milliseconds(arguments.over * 1e3)};
  const auto velocity = client.velocity(arguments.id, arguments.other, query);
  if (!velocity) return refuse(client, velocity.error(), arguments);
  return answer(arguments, velocity_json(arguments.id, arguments.other, *velocity),
                describe(*velocity, shown_by(arguments)));
}

int run_watch(Client& client, const Arguments& arguments) {
  return follow(client, arguments, [&](const StampedTransform& X_AB) {
    std::string text = describe(X_AB, shown_by(arguments), X_AB.basis.unspecified);
    if (X_AB.stamp && !arguments.json) {
      text += stamp_line(client, arguments, *X_AB.stamp);
    }
    (void)answer(arguments, arguments.json ? path_json(client, arguments, X_AB) : nlohmann::json(),
                 text);
  });
}

int run_echo(Client& client, const Arguments& arguments) {
  Screen screen;
  return follow(client, arguments, [&](const StampedTransform& X_AB) {
    if (arguments.json) {
      (void)answer(arguments, path_json(client, arguments, X_AB), "");
    } else {
      const auto now = present(client, arguments, arguments.id, arguments.other);
      screen.redraw(echo_lines(arguments.id, arguments.other, X_AB, now, arguments.angles));
    }
  });
}

int run_history(Client& client, const Arguments& arguments) {
  const auto histories = client.history(arguments.id);
  if (!histories) return refuse(client, histories.error(), arguments);
  if (histories->empty() || !histories->front().newest) {
    const std::uint64_t refused = histories->empty() ? 0 : histories->front().refused_ahead;
    const auto parent = client.parent(arguments.id);
    const auto lacks_sample = [&](const Query& query) {
      const auto X_PC = parent ? client.lookup(*parent, arguments.id, query) : StampedTransform();
      return !X_PC && X_PC.error().code == Errc::kNotYet;
    };
    // At any instant.
    const bool dynamic = lacks_sample({Time{}, {}, {}});
    const bool cleared = dynamic && lacks_sample({});
    const nlohmann::json json{
        {"id", arguments.id}, {"moving", dynamic}, {"samples", 0}, {"refused_ahead", refused}};
    std::string text = arguments.id + (cleared   ? " is dynamic: no sample since its history was "
                                                   "cleared\n"
                                       : dynamic ? " is dynamic: no sample yet\n"
                                                 : " is static: it holds for all times\n");
    if (refused > 0) text += "rejected     " + std::to_string(refused) + " too far ahead\n";
    return answer(arguments, json, text);
  }
  const auto parent = client.parent(arguments.id);
  const auto now = parent ? present(client, arguments, *parent, arguments.id) : std::nullopt;
  return answer(arguments, history_json(histories->front(), now),
                describe(histories->front(), now));
}

int run_monitor(Client& client, const Arguments& arguments) {
  Screen screen;
  do {
    nlohmann::json json = nlohmann::json::array();
    std::string text;
    const auto partitions = client.partitions();
    if (!partitions) return refuse(client, partitions.error(), arguments);
    if (partitions->empty() && arguments.once) {
      return refuse(client, {Errc::kUnknownPartition, "no partition"}, arguments);
    }
    if (partitions->empty()) text = nobody_answers(arguments) + "\n";
    for (const PartitionInfo& partition : *partitions) {
      const auto histories = client.histories(partition.name);
      const auto now = present(client, arguments, partition);
      nlohmann::json one{{"partition", partition.name}, {"reachable", histories.has_value()}};
      if (histories) {
        one["edges"] = nlohmann::json::array();
        for (const HistoryInfo& history : *histories)
          one["edges"].push_back(history_json(history, now));
        text += monitor_table(partition.name, *histories, now);
        if (const auto observed = client.consistency(partition.name)) {
          one["observed"] = nlohmann::json::array();
          for (const auto& edge : *observed) one["observed"].push_back(consistency_json(edge));
          text += consistency_table(*observed);
        }
        if (const auto joints = client.joints(partition.name)) {
          one["joints"] = nlohmann::json::array();
          for (const JointInfo& joint : *joints) one["joints"].push_back(joint_json(joint));
          text += outside_table(*joints, arguments.angles);
        }
      } else {
        text += "partition " + partition.name + ": " + histories.error().message + "\n";
      }
      json.push_back(std::move(one));
    }
    if (arguments.json) {
      (void)answer(arguments, {{"partitions", std::move(json)}}, "");
    } else {
      screen.redraw(text);
    }
  } while (!arguments.once && !interrupted_within(1.0 / arguments.rate));
  return kDone;
}

}  // namespace tfdude::cli
