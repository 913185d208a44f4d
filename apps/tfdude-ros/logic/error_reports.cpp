#include "error_reports.hpp"

#include <utility>

namespace tfdude::ros {

bool ErrorReports::is_new(const Error& error) {
  const bool has_instants = error.code == Errc::kNotYet || error.code == Errc::kTooOld;
  std::set<std::string>& told = has_instants ? without_data_ : told_;
  std::string about = error.message;
  if (has_instants) {
    about = std::string(to_string(error.code)) + '\n' + error.partition + '\n' + error.frame;
  }
  return told.size() < kMost && told.insert(std::move(about)).second;
}

}  // namespace tfdude::ros
