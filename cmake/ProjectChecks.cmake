# Tests of the project itself rather than of its code.
find_package(Python3 REQUIRED COMPONENTS Interpreter)

add_test(NAME "layers: sources" COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_layers.py)
add_test(NAME "layers: the check itself"
  COMMAND Python3::Interpreter ${CMAKE_SOURCE_DIR}/tests/check_layers.py --self-test)
set_tests_properties("layers: sources" "layers: the check itself" PROPERTIES LABELS unit TIMEOUT 60)

