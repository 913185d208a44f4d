#include "../commands.hpp"
#include "../sending.hpp"

namespace tfdude::cli {
namespace {

struct Publish final : LiveCommand {
  explicit Publish(CLI::App& app) {
    until_interrupted = true;
    auto* file = app.add_option("FILE", lines.file, "the samples; -: standard input");
    file->type_name("FILE")->required();
    lines.add_rate(app, file);
    app.footer(
        "A line of JSON: {\"edge\": ID, \"xyz\": [...], \"rpy\" or \"quat\" or \"matrix\": [...], "
        "\"stddev\" or \"cov\": [...]}, or {\"edges\": [such objects]}, or {\"joints\": {NAME: "
        "POSITION, ...}, \"stddev\": NUMBER}; with \"stamp\" in seconds or \"stamp_ns\".\n"
        "CSV begins with a line of names: edge, x, y, z, roll, pitch, yaw or qx, qy, qz, qw; or "
        "the names of joints; and stamp or stamp_ns.\n" +
        app.get_footer());
    explain_angles(app);
  }

  int ask(Client& client, const Common& common) const override {
    return lines.send(client, common, false);
  }

  SampleLines lines;
};

}  // namespace

void add_publish(Commands& commands) {
  commands.add<Publish>(
      "publish", "stream edges and joints from lines of JSON or CSV, not acknowledged",
      R"(publish - <<< '{"joints": {"elbow_joint": 1.6}, "stamp": 1795000000.5}')");
}

}  // namespace tfdude::cli
