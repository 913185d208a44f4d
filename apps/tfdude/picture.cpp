#include "picture.hpp"

#include <cerrno>
#include <fcntl.h>
#include <system_error>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "answer.hpp"
#include "drawing/svg.hpp"

namespace tfdude::cli {
namespace {

std::string reason() { return std::generic_category().message(errno); }

// Writes under another name and renames, so that the file is complete or does not change.
Result<void> write_file(const std::string& file, const std::string& bytes) {
  const std::string beside = file + "." + std::to_string(getpid()) + ".tmp";
  const auto failed = [&] {
    return fail(Errc::kInvalidInput, "cannot write " + quote(file) + ": " + reason());
  };
  const Descriptor out(open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (out.get() < 0) return failed();
  if (out.write_all(bytes) && rename(beside.c_str(), file.c_str()) == 0) return {};
  const auto error = failed();
  unlink(beside.c_str());
  return error;
}

}  // namespace

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
