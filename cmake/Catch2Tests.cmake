# All that differs in the build between Catch2 2.13 (Debian 12) and 3.7 (Debian 13). Gives
# tfdude_add_tests().
find_package(Catch2 REQUIRED)
include(Catch)

# Compiles the headers that all tests share once. Its one source is what CMake needs to do that.
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/precompiled.cpp "")
add_library(tfdude_tests_precompiled OBJECT ${CMAKE_CURRENT_BINARY_DIR}/precompiled.cpp)
set_target_properties(tfdude_tests_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON)
target_include_directories(tfdude_tests_precompiled PRIVATE ${CMAKE_SOURCE_DIR}/tests)
target_link_libraries(tfdude_tests_precompiled PRIVATE tfdude_open Catch2::Catch2 tfdude_options)
target_precompile_headers(tfdude_tests_precompiled PRIVATE ${CMAKE_SOURCE_DIR}/tests/support/precompiled.hpp)

# What Catch2 2 and 3 say where a filter matches no test case; 2 ends with success all the same.
set(TFDUDE_NOTHING_RAN "No test cases matched|No tests ran")

# tfdude_add_tests(target LABELS label... [TIMEOUT seconds] [SKIPPED_BY regex] SOURCES file...
# [LIBRARIES target...]): one Catch2 binary, each of its test cases a ctest test, which counts as skipped
# where it prints what the regular expression says.
function(tfdude_add_tests target)
  cmake_parse_arguments(ARG "" "TIMEOUT;SKIPPED_BY" "LABELS;SOURCES;LIBRARIES" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 60)
  endif()
  add_executable(${target} ${ARG_SOURCES})
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests)
  target_link_libraries(${target} PRIVATE test_support tfdude_open Catch2::Catch2WithMain tfdude_options
    ${ARG_LIBRARIES})
  # As the shared headers are compiled: an executable's objects would be -fPIE.
  target_compile_options(${target} PRIVATE -fPIC)
  target_precompile_headers(${target} REUSE_FROM tfdude_tests_precompiled)
  catch_discover_tests(${target} TEST_PREFIX "${target}: "
    PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  set(skipped_by "")
  if(ARG_SKIPPED_BY)
    set(skipped_by " SKIP_REGULAR_EXPRESSION \"${ARG_SKIPPED_BY}\"")
  endif()
  # Not among the PROPERTIES, which fall apart at the semicolon between two labels.
  set(labels_file ${CMAKE_CURRENT_BINARY_DIR}/${target}_labels.cmake)
  file(WRITE ${labels_file} "foreach(test IN LISTS ${target}_TESTS)
  set_tests_properties(\"\${test}\" PROPERTIES LABELS \"${ARG_LABELS}\"${skipped_by}
    FAIL_REGULAR_EXPRESSION \"${TFDUDE_NOTHING_RAN}\")
endforeach()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${labels_file})
endfunction()
