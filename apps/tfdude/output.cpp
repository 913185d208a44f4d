#include "output.hpp"

#include <cerrno>
#include <fcntl.h>
#include <system_error>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "program.hpp"

namespace tfdude::cli {

Result<void> write_file(const std::string& file, const std::string& bytes) {
  const std::string beside = file + "." + std::to_string(getpid()) + ".tmp";
  const auto failed = [&] {
    return fail(Errc::kInvalidInput,
                "cannot write " + quote(file) + ": " + std::generic_category().message(errno));
  };
  const Descriptor out(open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (out.get() < 0) return failed();
  if (out.write_all(bytes) && rename(beside.c_str(), file.c_str()) == 0) return {};
  const auto error = failed();
  unlink(beside.c_str());
  return error;
}

}  // namespace tfdude::cli
