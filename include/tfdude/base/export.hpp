#pragma once

/// Marks what the library exports; all other symbols are hidden.
#define TFDUDE_EXPORT __attribute__((visibility("default")))
