# Tests of the project itself rather than of its code: the layers, the words, the IDL, the installed package and the
# README.

# tfdude_add_check(name script [argument...]): a test of the sources, pages or scripts, which needs no build.
function(tfdude_add_check name script)
  add_test(NAME ${name} COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/${script} ${ARGN})
  set_tests_properties(${name} PROPERTIES LABELS project TIMEOUT 120)
endfunction()
tfdude_add_check("layers: sources" tests/check_layers.py)
tfdude_add_check("layers: the check itself" tests/check_layers.py --self-test)
tfdude_add_check("unity: names that files of a folder share" tests/check_unity.py)
tfdude_add_check("unity: the check itself" tests/check_unity.py --self-test)
tfdude_add_check("joining: the check itself" tests/join_files.py --self-test)
tfdude_add_check("version: all files say the same" tests/check_version.py)
tfdude_add_check("version: the check itself" tests/check_version.py --self-test)
tfdude_add_check("links: pages and headings that others name" tests/check_links.py)
tfdude_add_check("links: the check itself" tests/check_links.py --self-test)
tfdude_add_check("words: prose and identifiers" scripts/check_words.py)
tfdude_add_check("width: lines" scripts/check_width.py)
tfdude_add_check("release: its short checks" tests/packaging/check_release.py)
tfdude_add_check("times: the check itself" tests/check_times.py --self-test)
tfdude_add_check("readme: the check itself" tests/readme/type_blocks.py --self-test)
tfdude_add_check("bench: comparing" tests/bench/compare_test.py)
tfdude_add_check("bench: tables" tests/bench/tables_test.py)

# Checks that another vendor's compiler accepts the IDL; to it, names that differ only in case are the same name. It
# warns if a type does not declare its extensibility.
find_program(IDLC idlc REQUIRED)
file(GLOB idl_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/idl/*.idl)
foreach(idl ${idl_files})
  get_filename_component(name ${idl} NAME)
  add_test(NAME "idl: idlc compiles ${name}" COMMAND ${IDLC} -o ${CMAKE_BINARY_DIR}/Testing/idlc ${idl})
  set_tests_properties("idl: idlc compiles ${name}" PROPERTIES LABELS unit TIMEOUT 60
    FAIL_REGULAR_EXPRESSION "extensibility")
endforeach()

# If ctest cannot pass on a test's name, such as one with a semicolon, no test case runs. This must not count as passed.
add_test(NAME "suite: a test that runs nothing fails" COMMAND base_test "no test has this name")
set_tests_properties("suite: a test that runs nothing fails" PROPERTIES LABELS unit TIMEOUT 60
  FAIL_REGULAR_EXPRESSION "${TFDUDE_NOTHING_RAN}" WILL_FAIL TRUE)

set(consumer_flags "")
if(TFDUDE_SANITIZE)
  set(consumer_flags -fsanitize=${TFDUDE_SANITIZE})
endif()
add_test(NAME "install: consumer"
  COMMAND ${CMAKE_COMMAND}
    -D BUILD_DIR=${CMAKE_BINARY_DIR}
    -D CONFIG=$<CONFIG>
    -D CXX=${CMAKE_CXX_COMPILER}
    -D CXX_FLAGS=${consumer_flags}
    -P ${CMAKE_SOURCE_DIR}/tests/install_consumer/run.cmake)
set_tests_properties("install: consumer" PROPERTIES LABELS install TIMEOUT 300)

add_test(NAME "manual: its pages are complete and without warnings"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/packaging/check_manual.py ${CMAKE_BINARY_DIR})
foreach(shell zsh fish)
  add_test(NAME "completion: ${shell} completes words, names and files"
    COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/packaging/check_completion.py ${shell})
  set_tests_properties("completion: ${shell} completes words, names and files"
    PROPERTIES LABELS install TIMEOUT 120 SKIP_REGULAR_EXPRESSION "SKIPPED: ")
endforeach()
add_test(NAME "systemd: the units are valid, and the service is confined"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/packaging/check_units.py ${CMAKE_BINARY_DIR})
set_tests_properties("manual: its pages are complete and without warnings"
  "systemd: the units are valid, and the service is confined"
  PROPERTIES LABELS install TIMEOUT 60 SKIP_REGULAR_EXPRESSION "SKIPPED: ")

# The commands of README.md and docs/install.md work as typed in a fresh clone, also a second time.
add_test(NAME "readme: its lines and programs work"
  COMMAND ${CMAKE_COMMAND} -E env CXX=${CMAKE_CXX_COMPILER}
    $<TARGET_FILE:Python3::Interpreter> ${CMAKE_SOURCE_DIR}/tests/readme/type_blocks.py ${CMAKE_BINARY_DIR})
set_tests_properties("readme: its lines and programs work" PROPERTIES LABELS integration TIMEOUT 600)
add_test(NAME "tutorial: its lines and programs work"
  COMMAND ${CMAKE_COMMAND} -E env CXX=${CMAKE_CXX_COMPILER}
    $<TARGET_FILE:Python3::Interpreter> ${CMAKE_SOURCE_DIR}/tests/readme/type_blocks.py ${CMAKE_BINARY_DIR} --tutorial)
set_tests_properties("tutorial: its lines and programs work" PROPERTIES LABELS integration TIMEOUT 600)
