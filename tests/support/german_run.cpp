// Linked into a program of tests, this runs them with a German locale.

#include "support/german_locale.hpp"

namespace tfdude::testing {
namespace {

const GermanLocale kGerman;  // NOLINT(cert-err58-cpp): if it throws, no test may run

}  // namespace
}  // namespace tfdude::testing
