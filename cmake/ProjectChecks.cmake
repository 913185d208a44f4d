# Tests of the project itself rather than of its code: the layers, the words, the IDL, the installed package and the
# README.
find_package(Python3 REQUIRED COMPONENTS Interpreter)

add_test(NAME "layers: sources" COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_layers.py)
add_test(NAME "layers: the check itself"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_layers.py --self-test)
add_test(NAME "unity: names that files of a folder share"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_unity.py)
add_test(NAME "unity: the check itself"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_unity.py --self-test)
add_test(NAME "version: all files say the same"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_version.py)
add_test(NAME "version: the check itself"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_version.py --self-test)
add_test(NAME "words: prose and identifiers"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/scripts/check_words.py)
set_tests_properties("layers: sources" "layers: the check itself" "unity: names that files of a folder share"
  "unity: the check itself" "version: all files say the same" "version: the check itself" "words: prose and identifiers"
  PROPERTIES LABELS unit TIMEOUT 60)

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
add_test(NAME "readme: the check itself"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/readme/type_blocks.py --self-test)
set_tests_properties("readme: the check itself" PROPERTIES LABELS unit TIMEOUT 60)
add_test(NAME "bench: comparing" COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/bench/compare_test.py)
add_test(NAME "bench: tables" COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/bench/tables_test.py)
set_tests_properties("bench: comparing" "bench: tables" PROPERTIES LABELS unit)
