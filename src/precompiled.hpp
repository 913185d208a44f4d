#pragma once

// What most of the library's sources include, compiled once. Each source still includes what it uses: the preset dev
// builds without this header.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <variant>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <boost/graph/adjacency_list.hpp>
#include <spdlog/spdlog.h>
#include <tl/expected.hpp>
