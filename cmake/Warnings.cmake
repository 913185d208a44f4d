# Warnings and sanitizers for our own code, as an interface target.
add_library(tfdude_options INTERFACE)
target_compile_options(tfdude_options INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wold-style-cast
  -Wnon-virtual-dtor -Woverloaded-virtual -Werror=return-type -Werror=unused-result
  $<$<CXX_COMPILER_ID:Clang>:-Wthread-safety>)
if(NOT TFDUDE_UNITY)
  # Joined files may hide each other's names.
  target_compile_options(tfdude_options INTERFACE -Wshadow)
endif()
if(TFDUDE_WERROR)
  target_compile_options(tfdude_options INTERFACE -Werror)
endif()
if(TFDUDE_SANITIZE)
  add_compile_options(-fsanitize=${TFDUDE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${TFDUDE_SANITIZE})
endif()
