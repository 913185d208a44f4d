#include "time_render.hpp"

#include "format.hpp"
#include "render.hpp"
#include "table.hpp"
#include "terminal.hpp"

namespace tfdude::cli {
namespace {

double seconds(std::chrono::nanoseconds duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}
double milliseconds(std::chrono::nanoseconds duration) { return seconds(duration) * 1e3; }

double rate_of(const HistoryInfo& history) {
  return history.mean_gap.count() > 0 ? 1.0 / seconds(history.mean_gap) : 0.0;
}

std::string ago(Time stamp, std::optional<Time> now) {
  if (!now) return "of another clock";
  const double age = seconds(*now - stamp);
  return age < 0 ? format("%.6f s ahead of now", -age) : format("%.6f s ago", age);
}

}  // namespace

std::string seconds_of(Time stamp) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = nanoseconds(stamp);
  return format("%lld.%09lld", static_cast<long long>(ns / kSecond),
                static_cast<long long>(ns % kSecond));
}

std::string describe_stamp(Time stamp, std::optional<Time> now) {
  return "stamp        " + seconds_of(stamp) + "  (" + ago(stamp, now) + ")\n";
}

std::string describe_recorded_stamp(Time stamp, std::optional<Time> end) {
  if (!end) return describe_stamp(stamp, end);
  const double age = seconds(*end - stamp);
  const std::string when =
      age < 0 ? format("%.6f s after the end", -age) : format("%.6f s before the end", age);
  return "stamp        " + seconds_of(stamp) + "  (" + when + ")\n";
}

void add_stamp(nlohmann::json& json, const std::optional<Time>& stamp) {
  json["stamp"] =
      stamp ? nlohmann::json(static_cast<double>(nanoseconds(*stamp)) * 1e-9) : nlohmann::json();
  json["stamp_ns"] = stamp ? nlohmann::json(nanoseconds(*stamp)) : nlohmann::json();
}

std::string describe(const HistoryInfo& history, std::optional<Time> now) {
  std::string text =
      format("samples      %zu of at most %zu, %.3f s of at most %.3f s\n", history.samples,
             history.count_limit, history.newest ? seconds(*history.newest - *history.oldest) : 0.0,
             seconds(history.span_limit));
  if (history.newest) {
    text +=
        "oldest       " + seconds_of(*history.oldest) + "  (" + ago(*history.oldest, now) + ")\n";
    text +=
        "newest       " + seconds_of(*history.newest) + "  (" + ago(*history.newest, now) + ")\n";
    text += format("rate         %.3f Hz, jitter %.3f ms\n", rate_of(history),
                   milliseconds(history.jitter));
    text += format("gaps         %.3f ms on average, %.3f ms at most\n",
                   milliseconds(history.mean_gap), milliseconds(history.max_gap));
  }
  text += format("rejected     %llu too old, %llu duplicate stamps, %llu too far ahead\n",
                 static_cast<unsigned long long>(history.refused_old),
                 static_cast<unsigned long long>(history.refused_equal),
                 static_cast<unsigned long long>(history.refused_ahead));
  return text + format("memory       %zu bytes\n", history.bytes);
}

nlohmann::json history_json(const HistoryInfo& history, std::optional<Time> now) {
  nlohmann::json json{{"id", history.id},
                      {"moving", history.newest.has_value()},
                      {"samples", history.samples},
                      {"bytes", history.bytes},
                      {"span_limit", seconds(history.span_limit)},
                      {"count_limit", history.count_limit},
                      {"rate", rate_of(history)},
                      {"mean_gap", seconds(history.mean_gap)},
                      {"max_gap", seconds(history.max_gap)},
                      {"jitter", seconds(history.jitter)},
                      {"refused_old", history.refused_old},
                      {"refused_equal", history.refused_equal},
                      {"refused_ahead", history.refused_ahead}};
  if (!history.newest) return json;
  json["oldest_ns"] = nanoseconds(*history.oldest);
  json["newest_ns"] = nanoseconds(*history.newest);
  json["span"] = seconds(*history.newest - *history.oldest);
  json["age"] = now ? nlohmann::json(seconds(*now - *history.newest)) : nlohmann::json();
  return json;
}

HistorySum sum_of(const std::vector<HistoryInfo>& histories) {
  HistorySum sum;
  for (const HistoryInfo& history : histories) {
    if (history.newest) ++sum.edges;
    sum.samples += history.samples;
    sum.bytes += history.bytes;
  }
  return sum;
}

std::string describe(const HistorySum& sum) {
  return format("%zu samples of %zu edges, %.1f KiB", sum.samples, sum.edges,
                static_cast<double>(sum.bytes) / 1024.0);
}

std::string echo_lines(const std::string& a, const std::string& b, const StampedTransform& X_AB,
                       std::optional<Time> now, const AngleUnit& angles) {
  const Eigen::Vector3d t = X_AB.pose.translation();
  const Eigen::Vector3d rpy = to_rpy(X_AB.pose.rotation()) * angles.per_radian;
  const auto s = X_AB.covariance.of_specified().stddev();
  std::string text = shortened(b, room(34, 34)) + " seen from " + shortened(a, room(34, 34)) + "\n";
  text += format("position  %12.6f %12.6f %12.6f m\n", t.x(), t.y(), t.z());
  const auto row = [&](double x, double y, double z) {
    return format("%12.*f %12.*f %12.*f %s\n", angles.decimals, x, angles.decimals, y,
                  angles.decimals, z, angles.name);
  };
  text += "rpy       " + row(rpy.x(), rpy.y(), rpy.z());
  const bool complete = X_AB.covariance.complete();
  if (!complete) {
    text += "std dev   " + shortened(unspecified_text(X_AB.basis.unspecified), room(70)) + "\n";
  }
  text += (complete ? "std dev   " : "of others ") +
          format("%12.6f %12.6f %12.6f m\n", s[0], s[1], s[2]);
  const double unit = angles.per_radian;
  text += "          " + row(s[3] * unit, s[4] * unit, s[5] * unit);
  return text + "age       " + (X_AB.stamp ? ago(*X_AB.stamp, now) : "none (static)") + "\n";
}

std::string monitor_table(const std::string& partition, const std::vector<HistoryInfo>& histories,
                          std::optional<Time> now) {
  std::string text =
      "partition " + shortened(partition, room(24)) + ": " + describe(sum_of(histories)) + "\n";
  if (histories.empty()) return text;
  std::vector<std::string> edges;
  for (const HistoryInfo& history : histories) edges.push_back(history.id);
  const std::size_t columns = name_width(edges, 22);
  const auto row = [&](const std::string& edge, const std::string& rate, const std::string& age,
                       const std::string& jitter, const std::string& gap,
                       const std::string& rejected) {
    return "  " + cell(edge, columns) +
           format(" %10s %10s %11s %10s %9s\n", rate.c_str(), age.c_str(), jitter.c_str(),
                  gap.c_str(), rejected.c_str());
  };
  text += painted(Look::kHeader,
                  row("edge", "rate [Hz]", "age [ms]", "jitter [ms]", "gap [ms]", "rejected"));
  for (const HistoryInfo& history : histories) {
    const std::uint64_t rejected =
        history.refused_old + history.refused_equal + history.refused_ahead;
    text += row(history.id, number(rate_of(history), 1, 10),
                history.newest && now ? number(milliseconds(*now - *history.newest), 1, 10) : "-",
                number(milliseconds(history.jitter), 3, 11),
                number(milliseconds(history.max_gap), 3, 10),
                number(static_cast<double>(rejected), 0, 9));
  }
  return text;
}

}  // namespace tfdude::cli
