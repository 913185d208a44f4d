#include "simulation/calm.hpp"
#include "support/catch.hpp"

TEST_CASE("placeholder") { CHECK(tfdude::simulation::run_calm({10, 100})); }
