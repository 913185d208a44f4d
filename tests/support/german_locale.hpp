#pragma once

#include <locale>
#include <string>

namespace tfdude::testing {

/// While it exists, the process has a German locale, of C and of C++: a comma before the decimals,
/// and points between the thousands.
class GermanLocale {
 public:
  /// @throws std::runtime_error if there is none.
  GermanLocale();
  ~GermanLocale();
  GermanLocale(const GermanLocale&) = delete;
  GermanLocale& operator=(const GermanLocale&) = delete;

 private:
  std::locale before_;
  std::string c_before_;
};

}  // namespace tfdude::testing
