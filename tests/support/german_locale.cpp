#include "support/german_locale.hpp"

#include <clocale>
#include <cstdlib>
#include <stdexcept>

namespace tfdude::testing {

// The build makes the locale: few computers have it.
GermanLocale::GermanLocale() : c_before_(std::setlocale(LC_ALL, nullptr)) {
  setenv("LOCPATH", TFDUDE_LOCALES, 1);
  before_ = std::locale::global(std::locale("de_DE.UTF-8"));
  if (std::setlocale(LC_ALL, "de_DE.UTF-8") == nullptr ||
      std::string(std::localeconv()->decimal_point) != "," ||
      std::use_facet<std::numpunct<char>>(std::locale()).thousands_sep() != '.') {
    throw std::runtime_error("the German locale is not as expected");
  }
  std::setlocale(LC_MESSAGES, "C");  // the messages of the system, not ours, are in its language
}

GermanLocale::~GermanLocale() {
  std::locale::global(before_);
  std::setlocale(LC_ALL, c_before_.c_str());
  unsetenv("LOCPATH");
}

}  // namespace tfdude::testing
