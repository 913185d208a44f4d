#include "joint.hpp"

#include "tfdude/base/id.hpp"

#include "../../numbers.hpp"
#include "../../rendering/format.hpp"
#include "../../rendering/text.hpp"
#include "../commands.hpp"
#include "../known_joints.hpp"
#include "../samples.hpp"
#include "../sending.hpp"

namespace tfdude::cli {

std::string position_text(const JointInfo& joint, double position, const AngleUnit& angles) {
  std::string text = format("%.6g %s", in_unit(joint, position, angles), unit_of(joint, angles));
  if (!joint.limits || joint.limits->contain(position)) return text;
  return text + ", outside its limits " + limits_of(joint, angles) + " " + unit_of(joint, angles);
}

namespace {

Result<JointValue> typed_joint(const std::string& word, const std::string& name,
                               const std::string& number) {
  if (const auto position = to_number(number)) return JointValue{name, *position};
  std::string why = quote(word) + " is not NAME=POSITION";
  if (!number.empty()) why += ": joint " + quote(name) + ": " + quote(number) + " is not a number";
  return fail(Errc::kInvalidInput, why);
}

// A name may contain '=', a position cannot. The unit is that of the command line.
Result<std::vector<JointValue>> typed_joints(const std::vector<std::string>& words) {
  const auto has_equals = [](const std::string& word) {
    return word.find('=') != std::string::npos;
  };
  const bool is_pair =
      words.size() == 2 && !has_equals(words[1]) && (is_number(words[1]) || !has_equals(words[0]));
  if (is_pair) {
    return typed_joint(words[0], words[0], words[1]).map([](JointValue one) {
      return std::vector<JointValue>{std::move(one)};
    });
  }
  std::vector<JointValue> typed;
  for (const std::string& word : words) {
    const std::size_t equals = word.rfind('=');
    auto one = typed_joint(word, word.substr(0, equals),
                           equals == std::string::npos ? "" : word.substr(equals + 1));
    if (!one) return tl::unexpected(std::move(one.error()));
    typed.push_back(*std::move(one));
  }
  if (typed.empty()) return fail(Errc::kInvalidInput, "no joint is given: NAME=POSITION");
  return typed;
}

struct Joint final : LiveCommand {
  explicit Joint(CLI::App& app) {
    auto* joints = app.add_option("JOINTS", words,
                                  "NAME=POSITION of each joint, or one NAME POSITION [rad or m]");
    app.add_option("--stddev", stddev, "standard deviation of the positions [rad or m]")
        ->type_name("NUMBER")
        ->check(within(0, 1e9, "0 to 1e9"));
    add_sample_stamp(app, stamp);
    auto* from = app.add_option_function<std::string>(
        "--from",
        [this](const std::string& file) {
          lines.file = file;
          until_interrupted = true;
        },
        "positions from this file, or - for standard input: the lines of tfdude publish, each "
        "acknowledged");
    from->type_name("FILE")->excludes(joints)->excludes("--stamp")->excludes("--stddev");
    lines.add_rate(app, from);
    explain_angles(app);
  }

  int ask(Client& client, const Common& common) const override {
    if (!lines.file.empty()) return lines.send(client, common, true);
    auto values = typed_joints(words);
    if (!values) {
      (void)report(values.error(), common);
      return kWrongUsage;
    }
    const auto at = optional_stamp(client, stamp);
    if (!at) return report(at.error(), common);
    const auto known = known_joints(client);
    const SampleReader units(common.angles, known);
    for (JointValue& value : *values) {
      const auto position = units.position(value.name, value.position);
      if (!position) return report_cause(client, position.error(), common);
      value.position = *position;
      if (!stddev) continue;
      const double deviation = *units.position(value.name, *stddev);
      value.variance = deviation * deviation;
    }
    const auto updated = client.update_joints(*values, *at);
    if (!updated) return report_cause(client, updated.error(), common);
    auto json = nlohmann::json::array();
    auto ignored = nlohmann::json::array();
    std::string text;
    for (const JointValue& value : *values) {
      const auto joint = known.find(value.name);
      if (joint != known.end() && joint->second.mimic) {
        ignored.push_back(value.name);
        text += "ignored " + value.name + ": it follows " + joint->second.mimic->joint + "\n";
        continue;
      }
      json.push_back({{"name", value.name}, {"position", value.position}});
      text += "moved " + value.name;
      if (joint != known.end()) {
        const JointInfo& info = joint->second;
        json.back()["outside"] = info.limits && !info.limits->contain(value.position);
        text += " to " + position_text(info, value.position, common.angles);
      }
      text += "\n";
    }
    return answer(common,
                  {{"done", "moved"}, {"joints", std::move(json)}, {"ignored", std::move(ignored)}},
                  text);
  }

  std::vector<std::string> words;  // a name and a position, or NAME=POSITION each
  std::optional<double> stddev;
  std::string stamp;
  SampleLines lines;
};

}  // namespace

void add_joint(Commands& commands) {
  commands.add<Joint>("joint", "set positions of joints, as one commit of each owner",
                      "joint shoulder_pan_joint=0.5 elbow_joint=1.6 --stddev 0.001");
}

}  // namespace tfdude::cli
