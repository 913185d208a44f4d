#include "../commands.hpp"

namespace tfdude::cli {
namespace {

struct Description final : LiveCommand {
  explicit Description(CLI::App& app) {
    app.add_option("PARTITION", partition, "the partition")->required();
  }

  int ask(Client& client, const Common& common) const override {
    const auto text = client.description(partition);
    if (!text) return report_cause(client, text.error(), common);
    if (text->empty()) {
      return report(
          {Errc::kInvalidInput,
           "partition '" + partition + "' has no description: it serves no URDF, or several"},
          common);
    }
    return answer(common, {{"partition", partition}, {"description", *text}}, *text);
  }

  std::string partition;
};

}  // namespace

void add_description(Commands& commands) {
  commands.add<Description>("description", "print the URDF that a partition's daemon serves",
                            "description arm > arm.urdf");
}

}  // namespace tfdude::cli
