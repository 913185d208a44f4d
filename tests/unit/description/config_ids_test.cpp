#include <string>

#include "tfdude/description/config.hpp"

#include "support/catch.hpp"

namespace {

std::string error_of(const std::string& text) {
  const auto config = tfdude::parse_config(text, "f");
  return config ? std::string() : config.error().message;
}

}  // namespace

TEST_CASE("config: ids that look like others are rejected") {
  CHECK(error_of("frames: [{id: left hand, parent: a b}]").empty());
  CHECK(error_of("frames: [{id: ' a'}]") == "f:1: frames[0]: id ' a' begins with a space");
  CHECK(error_of("frames: [{id: b, parent: 'a '}]") ==
        "f:1: frame 'b': parent 'a ' ends with a space");
  CHECK(error_of("frames: [{id: b, sources: {'s ': [[0, 0, 0, 0, 0, 1]]}}]") ==
        "f:1: frame 'b': source 's ' ends with a space");
  CHECK(error_of("partition: ' a'") == "f:1: partition ' a' begins with a space");
  CHECK(error_of("urdf: [{file: r.urdf, root: 'a '}]") ==
        "f:1: urdf[0]: root 'a ' ends with a space");
}
