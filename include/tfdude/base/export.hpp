#pragma once

/// What the library offers to others: all else in it is hidden.
#define TFDUDE_EXPORT __attribute__((visibility("default")))
