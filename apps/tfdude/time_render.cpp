#include "time_render.hpp"

#include "format.hpp"

namespace tfdude::cli {
namespace {

double seconds(std::chrono::nanoseconds duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}
double milliseconds(std::chrono::nanoseconds duration) { return seconds(duration) * 1e3; }

double rate_of(const PastInfo& past) {
  return past.mean_gap.count() > 0 ? 1.0 / seconds(past.mean_gap) : 0.0;
}

std::string ago(Time stamp, Time now) {
  const double age = seconds(now - stamp);
  return age < 0 ? format("%.6f s ahead of now", -age) : format("%.6f s ago", age);
}

}  // namespace

std::string seconds_of(Time stamp) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = nanoseconds(stamp);
  return format("%lld.%09lld", static_cast<long long>(ns / kSecond),
                static_cast<long long>(ns % kSecond));
}

std::string describe_stamp(const std::optional<Time>& stamp, Time now) {
  if (!stamp) return "stamp        none: holds for all times\n";
  return "stamp        " + seconds_of(*stamp) + "  (" + ago(*stamp, now) + ")\n";
}

void add_stamp(nlohmann::json& json, const std::optional<Time>& stamp) {
  json["stamp"] =
      stamp ? nlohmann::json(static_cast<double>(nanoseconds(*stamp)) * 1e-9) : nlohmann::json();
  json["stamp_ns"] = stamp ? nlohmann::json(nanoseconds(*stamp)) : nlohmann::json();
}

std::string describe(const PastInfo& past, Time now) {
  std::string text = format(
      "samples      %zu of at most %zu, %.3f s of at most %.3f s\n", past.samples, past.count_limit,
      past.newest ? seconds(*past.newest - *past.oldest) : 0.0, seconds(past.span_limit));
  if (past.newest) {
    text += "oldest       " + seconds_of(*past.oldest) + "  (" + ago(*past.oldest, now) + ")\n";
    text += "newest       " + seconds_of(*past.newest) + "  (" + ago(*past.newest, now) + ")\n";
    text += format("rate         %.3f Hz, gaps %.3f ms on average, %.3f at most, jitter %.3f ms\n",
                   rate_of(past), milliseconds(past.mean_gap), milliseconds(past.max_gap),
                   milliseconds(past.jitter));
  }
  text += format("refused      %llu too old, %llu of a stamp that was taken\n",
                 static_cast<unsigned long long>(past.refused_old),
                 static_cast<unsigned long long>(past.refused_equal));
  return text + format("memory       %zu bytes\n", past.bytes);
}

nlohmann::json past_json(const PastInfo& past, Time now) {
  nlohmann::json json{{"id", past.id},
                      {"moving", past.newest.has_value()},
                      {"samples", past.samples},
                      {"bytes", past.bytes},
                      {"span_limit", seconds(past.span_limit)},
                      {"count_limit", past.count_limit},
                      {"rate", rate_of(past)},
                      {"mean_gap", seconds(past.mean_gap)},
                      {"max_gap", seconds(past.max_gap)},
                      {"jitter", seconds(past.jitter)},
                      {"refused_old", past.refused_old},
                      {"refused_equal", past.refused_equal}};
  if (!past.newest) return json;
  json["oldest_ns"] = nanoseconds(*past.oldest);
  json["newest_ns"] = nanoseconds(*past.newest);
  json["span"] = seconds(*past.newest - *past.oldest);
  json["age"] = seconds(now - *past.newest);
  return json;
}

PastSum sum_of(const std::vector<PastInfo>& pasts) {
  PastSum sum;
  for (const PastInfo& past : pasts) {
    if (past.newest) ++sum.edges;
    sum.samples += past.samples;
    sum.bytes += past.bytes;
  }
  return sum;
}

std::string describe(const PastSum& sum) {
  return format("%zu samples of %zu edges, %.1f KiB", sum.samples, sum.edges,
                static_cast<double>(sum.bytes) / 1024.0);
}

std::string echo_lines(const std::string& a, const std::string& b, const StampedTransform& X_AB,
                       Time now) {
  const Eigen::Vector3d t = X_AB.pose.translation();
  const Eigen::Vector3d rpy = to_rpy(X_AB.pose.rotation()) * kDegrees;
  const auto s = X_AB.covariance.stddev();
  std::string text = b + " seen from " + a + "\n";
  text += format("position  %12.6f %12.6f %12.6f m\n", t.x(), t.y(), t.z());
  text += format("rpy       %12.4f %12.4f %12.4f deg\n", rpy.x(), rpy.y(), rpy.z());
  text += format("std dev   %12.6f %12.6f %12.6f m\n", s[0], s[1], s[2]);
  text += format("          %12.4f %12.4f %12.4f deg\n", s[3] * kDegrees, s[4] * kDegrees,
                 s[5] * kDegrees);
  return text + "age       " + (X_AB.stamp ? ago(*X_AB.stamp, now) : "none: it does not move") +
         "\n";
}

std::string monitor_table(const std::string& partition, const std::vector<PastInfo>& pasts,
                          Time now) {
  std::string text = "partition " + partition + ": " + describe(sum_of(pasts)) + "\n";
  if (pasts.empty()) return text;
  text += format("  %-24s %10s %10s %10s %10s %10s\n", "edge", "rate [Hz]", "age [ms]",
                 "jitter[ms]", "gap [ms]", "refused");
  for (const PastInfo& past : pasts) {
    const std::string age =
        past.newest ? format("%.1f", milliseconds(now - *past.newest)) : std::string("-");
    text += format("  %-24s %10.1f %10s %10.3f %10.3f %10llu\n", past.id.c_str(), rate_of(past),
                   age.c_str(), milliseconds(past.jitter), milliseconds(past.max_gap),
                   static_cast<unsigned long long>(past.refused_old + past.refused_equal));
  }
  return text;
}

}  // namespace tfdude::cli
