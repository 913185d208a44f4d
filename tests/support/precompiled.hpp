#pragma once

// Headers that most tests include, compiled once for all of them; the dev preset builds without it.
#include <future>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
