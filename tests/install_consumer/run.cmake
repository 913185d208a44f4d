# Installs a build to a fresh prefix, then configures, builds and runs a project that uses the package:
#   cmake -D BUILD_DIR=... -D CONFIG=... -D CXX=... [-D CXX_FLAGS=...] -P run.cmake
set(work ${BUILD_DIR}/install_test)
string(TOUPPER "${CONFIG}" config)
file(REMOVE_RECURSE ${work})

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --config ${CONFIG} --prefix ${work}/prefix)
# Moved after the install, so that a path of the build or of the prefix left in the package shows.
file(RENAME ${work}/prefix ${work}/moved)
# What is installed for users is decided, header by header.
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/headers.txt expected)
file(GLOB_RECURSE installed RELATIVE ${work}/moved/include ${work}/moved/include/*)
list(SORT installed)
if(NOT installed STREQUAL expected)
  message(FATAL_ERROR "installed headers are not those of headers.txt:\n  ${installed}")
endif()
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${work}/build -G Ninja
  -D CMAKE_BUILD_TYPE=${CONFIG}
  -D CMAKE_CXX_COMPILER=${CXX}
  -D CMAKE_CXX_FLAGS=${CXX_FLAGS}
  -D CMAKE_CXX_FLAGS_${config}=-O0
  -D CMAKE_PREFIX_PATH=${work}/moved
  -D CMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
run(${CMAKE_COMMAND} --build ${work}/build)
run(${work}/build/consumer)

# The programs find the library of their own prefix.
foreach(program tfduded tfdude)
  if(EXISTS ${work}/moved/bin/${program})
    run(${work}/moved/bin/${program} --help)
  endif()
endforeach()

# The example of another DDS is a project of its own, and finds the installed IDL.
run(${CMAKE_COMMAND} -S ${work}/moved/share/tfdude/examples/other-dds -B ${work}/other-dds -G Ninja)
run(${CMAKE_COMMAND} --build ${work}/other-dds)
