# Contains all differences in the build between Catch2 2.13 (Debian 12) and 3.7 (Debian 13). Defines tfdude_add_tests().
find_package(Catch2 REQUIRED)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
include(Catch)

# Compiles the headers that all tests share, once without and once with optimization, because the compiler takes
# precompiled headers only if they have the same. CMake needs a source for that, so there is an empty one.
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/precompiled.cpp "")
foreach(target tfdude_tests_precompiled tfdude_tests_precompiled_optimized)
  add_library(${target} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/precompiled.cpp)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests)
  target_link_libraries(${target} PRIVATE tfdude_open Catch2::Catch2 tfdude_options)
  target_precompile_headers(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests/support/precompiled.hpp)
endforeach()
set(TFDUDE_OPTIMIZED_TEST $<$<CONFIG:Release>:-O1>)
target_compile_options(tfdude_tests_precompiled_optimized PRIVATE ${TFDUDE_OPTIMIZED_TEST})

# tfdude_use_precompiled([OPTIMIZED] target...): for tests, and for their programs that are no Catch2 binaries.
function(tfdude_use_precompiled)
  cmake_parse_arguments(ARG "OPTIMIZED" "" "" ${ARGN})
  foreach(target IN LISTS ARG_UNPARSED_ARGUMENTS)
    # Uses -fPIC as the shared headers do: by default an executable's objects have -fPIE.
    target_compile_options(${target} PRIVATE -fPIC)
    if(ARG_OPTIMIZED)
      target_compile_options(${target} PRIVATE ${TFDUDE_OPTIMIZED_TEST})
      target_precompile_headers(${target} REUSE_FROM tfdude_tests_precompiled_optimized)
    else()
      target_precompile_headers(${target} REUSE_FROM tfdude_tests_precompiled)
    endif()
  endforeach()
endfunction()

# The output of Catch2 2 and 3 if a filter matches no test case; Catch2 2 still exits with success.
set(TFDUDE_NOTHING_RAN "No test cases matched|No tests ran")

# tfdude_join_tests(target files): names of sources. With TFDUDE_UNITY (cmake/Unity.cmake), tests are compiled sixteen
# once, by files in the build tree that take their place.
function(tfdude_join_tests target files)
  if(NOT TFDUDE_UNITY)
    return()
  endif()
  set(others ${${files}})
  list(FILTER others EXCLUDE REGEX "_test\\.cpp$")
  set(tests ${${files}})
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")
  list(TRANSFORM tests PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  while(tests)
    list(SUBLIST tests 0 16 together)
    list(REMOVE_ITEM tests ${together})
    list(LENGTH tests left)
    list(LENGTH together count)
    set(joined ${CMAKE_CURRENT_BINARY_DIR}/joined/${target}_${left}.cpp)
    if(count EQUAL 1)
      set(joined ${together})
    else()
      add_custom_command(OUTPUT ${joined}
        COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/join_files.py ${joined} ${together}
        DEPENDS ${CMAKE_SOURCE_DIR}/tests/join_files.py ${together} COMMENT "Joining tests of ${target}" VERBATIM)
      target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})  # where they are themselves
      target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
    endif()
    list(APPEND others ${joined})
  endwhile()
  set(${files} ${others} PARENT_SCOPE)
endfunction()

# tfdude_add_tests(target [OPTIMIZED] LABELS label... [TIMEOUT seconds] [SKIPPED_BY regex] SOURCES file...
# [LIBRARIES target...]): adds a Catch2 binary. Each of its test cases becomes a ctest test, which counts as skipped if
# its output matches the regular expression. OPTIMIZED is for tests that compute for seconds.
function(tfdude_add_tests target)
  cmake_parse_arguments(ARG "OPTIMIZED" "TIMEOUT;SKIPPED_BY" "LABELS;SOURCES;LIBRARIES" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 60)
  endif()
  if(CMAKE_CROSSCOMPILING)
    math(EXPR ARG_TIMEOUT "20 * ${ARG_TIMEOUT}")  # an emulator runs them
  endif()
  add_executable(${target})
  tfdude_join_tests(${target} ARG_SOURCES)
  target_sources(${target} PRIVATE ${ARG_SOURCES})
  target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/tests)
  target_link_libraries(${target} PRIVATE result_errors test_support tfdude_open Catch2::Catch2WithMain tfdude_options
    ${ARG_LIBRARIES})
  if(ARG_OPTIMIZED)
    tfdude_use_precompiled(OPTIMIZED ${target})
  else()
    tfdude_use_precompiled(${target})
  endif()
  catch_discover_tests(${target} TEST_PREFIX "${target}: "
    PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  set(more "")
  if(ARG_SKIPPED_BY)
    set(more " SKIP_REGULAR_EXPRESSION \"${ARG_SKIPPED_BY}\"")
  endif()
  # Fast DDS 2.9 deletes its statistics of a reader through a base class without a virtual destructor.
  if(TFDUDE_SANITIZE MATCHES address)
    string(APPEND more " ENVIRONMENT ASAN_OPTIONS=new_delete_type_mismatch=0")
  endif()
  # The labels are not among the PROPERTIES above, where the semicolon between two labels would split the list.
  set(labels_file ${CMAKE_CURRENT_BINARY_DIR}/${target}_labels.cmake)
  file(WRITE ${labels_file} "foreach(test IN LISTS ${target}_TESTS)
  set_tests_properties(\"\${test}\" PROPERTIES LABELS \"${ARG_LABELS}\"${more}
    FAIL_REGULAR_EXPRESSION \"${TFDUDE_NOTHING_RAN}\")
endforeach()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${labels_file})
endfunction()
