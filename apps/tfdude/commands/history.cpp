#include "history.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../../rendering/quantities.hpp"
#include "../../rendering/text.hpp"
#include "../commands.hpp"

namespace tfdude::cli {

std::string describe(const HistoryInfo& history, std::optional<Time> now) {
  const double span = seconds(*history.newest - *history.oldest);
  std::string text =
      format("samples      %zu of at most %zu, %.3f s of at most %.3f s\n", history.samples,
             history.count_limit, span, seconds(history.span_limit));
  text += "oldest       " + seconds_of(*history.oldest) + "  (" + ago(*history.oldest, now) + ")\n";
  text += "newest       " + seconds_of(*history.newest) + "  (" + ago(*history.newest, now) + ")\n";
  text += format("rate         %.3f Hz, jitter %.3f ms\n", rate_of(history),
                 1e3 * seconds(history.jitter));
  text += format("gaps         %.3f ms on average, %.3f ms at most\n",
                 1e3 * seconds(history.mean_gap), 1e3 * seconds(history.max_gap));
  text += format("rejected     %llu too old, %llu duplicate stamps, %llu too far ahead\n",
                 static_cast<unsigned long long>(history.refused_old),
                 static_cast<unsigned long long>(history.refused_equal),
                 static_cast<unsigned long long>(history.refused_ahead));
  return text + format("memory       %zu bytes\n", history.bytes);
}

namespace {

struct History final : FrameCommand {
  using FrameCommand::FrameCommand;

  int ask(Client& client, const Common& common) const override {
    const auto histories = client.history(id);
    if (!histories) return report_cause(client, histories.error(), common);
    const auto parent = client.parent(id);
    if (histories->empty() || !histories->front().newest) {
      return answer_without_samples(client, common, *histories, parent);
    }
    const auto now = parent ? present(client, common, *parent, id) : std::nullopt;
    return answer(common, history_json(histories->front(), now), describe(histories->front(), now));
  }

  int answer_without_samples(Client& client, const Common& common,
                             const std::vector<HistoryInfo>& histories,
                             const Result<std::string>& parent) const {
    const std::uint64_t rejected = histories.empty() ? 0 : histories.front().refused_ahead;
    const auto lacks_sample = [&](const Query& query) {
      const auto X_PC = parent ? client.lookup(*parent, id, query) : StampedTransform();
      return !X_PC && X_PC.error().code == Errc::kNotYet;
    };
    // At any instant.
    const bool dynamic = lacks_sample({Time{}, {}, {}});
    const bool cleared = dynamic && lacks_sample({});
    std::string text = id + (cleared   ? " is dynamic: no sample since its history was cleared\n"
                             : dynamic ? " is dynamic: no sample yet\n"
                                       : " is static: it holds for all times\n");
    if (rejected > 0) text += "rejected     " + std::to_string(rejected) + " too far ahead\n";
    return answer(common,
                  {{"id", id}, {"moving", dynamic}, {"samples", 0}, {"refused_ahead", rejected}},
                  text);
  }
};

}  // namespace

void add_history(Commands& commands) {
  commands.add<History>("history", "an edge's history: samples, rate, age, rejected samples",
                        "history hand_left");
}

}  // namespace tfdude::cli
