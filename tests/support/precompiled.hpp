#pragma once

// What most tests include, compiled once for all of them; the preset dev builds without it.
#include <future>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
