#include "tfdude/math/transform.hpp"

#include "support/catch.hpp"

TEST_CASE("exp and log are inverse") {
  const tfdude::Twist xi = (tfdude::Twist() << 1, 2, 3, 0.1, 0.2, 0.3).finished();
  CHECK((tfdude::log(tfdude::exp(xi)) - xi).norm() < 1e-12);
}
