// Linked into all programs of tests: Result::value() fails a test with the message of the error.

#include "support/catch.hpp"

CATCH_TRANSLATE_EXCEPTION(const tl::bad_expected_access<tfdude::Error>& access) {
  return access.error().message;
}
