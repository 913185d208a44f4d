#include "picture.hpp"

#include "tfdude/base/id.hpp"

#include "answer.hpp"
#include "drawing/svg.hpp"
#include "output.hpp"

namespace tfdude::cli {

int answer_picture(Source source, const Common& common, const std::string& file,
                   const std::string& drawn, const std::map<std::string, Program>& programs,
                   nlohmann::json json) {
  const std::string ending = file.substr(file.rfind('.'));
  const auto program = programs.find(ending);
  auto picture = program == programs.end() ? drawn : run_program(program->second, drawn);
  if (ending == ".svg") picture = picture.map(xml_allowed);
  const auto written =
      picture.and_then([&](const std::string& bytes) { return write_file(file, bytes); });
  if (!written) return report_cause(source, written.error(), common);
  json["file"] = file;
  return answer(common, json, "wrote " + printable(file) + "\n");
}

}  // namespace tfdude::cli
