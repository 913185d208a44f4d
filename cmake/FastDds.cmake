# Contains all differences in the build between Fast DDS 2.9 (Debian 12) and 3.1 (Debian 13): the names of the package,
# of its targets and of the files that fastddsgen writes. Defines the target tfdude_fastdds and the function
# tfdude_generate_idl().
find_package(fastcdr REQUIRED)
find_package(fastdds QUIET)
if(fastdds_FOUND)
  set(TFDUDE_FASTDDS_MAJOR 3)
  set(TFDUDE_FASTDDS_VERSION ${fastdds_VERSION})
  set(_fastdds_target fastdds)
  # tinyxml2 defines this, through Fast DDS, for some targets; shared precompiled headers require it for all.
  add_compile_definitions(_FILE_OFFSET_BITS=64)
else()
  find_package(fastrtps 2.9 REQUIRED)
  set(TFDUDE_FASTDDS_MAJOR 2)
  set(TFDUDE_FASTDDS_VERSION ${fastrtps_VERSION})
  set(_fastdds_target fastrtps)
endif()
add_library(tfdude_fastdds INTERFACE)
target_link_libraries(tfdude_fastdds INTERFACE ${_fastdds_target} fastcdr)
target_compile_definitions(tfdude_fastdds INTERFACE TFDUDE_FASTDDS_MAJOR=${TFDUDE_FASTDDS_MAJOR})

find_program(FASTDDSGEN fastddsgen REQUIRED)

# tfdude_generate_idl(target file.idl): generates C++ from an IDL file in the build tree, as an object library. Its
# headers are system headers for targets that link it. NAME_types.hpp includes the types and their serialization.
function(tfdude_generate_idl target idl)
  get_filename_component(name ${idl} NAME_WE)
  set(dir ${CMAKE_CURRENT_BINARY_DIR}/generated)
  file(MAKE_DIRECTORY ${dir})
  if(TFDUDE_FASTDDS_MAJOR EQUAL 2)
    set(sources ${dir}/${name}.cxx ${dir}/${name}PubSubTypes.cxx)
    set(headers ${dir}/${name}.h ${dir}/${name}PubSubTypes.h)
    set(flags -cs)
    set(included ${name}PubSubTypes.h)
  else()
    set(sources ${dir}/${name}PubSubTypes.cxx ${dir}/${name}TypeObjectSupport.cxx)
    set(headers ${dir}/${name}.hpp ${dir}/${name}PubSubTypes.hpp ${dir}/${name}CdrAux.hpp
                ${dir}/${name}CdrAux.ipp ${dir}/${name}TypeObjectSupport.hpp)
    set(flags -cs)
    set(included ${name}PubSubTypes.hpp)
  endif()
  file(CONFIGURE OUTPUT ${dir}/${name}_types.hpp CONTENT "#pragma once\n#include <${included}>\n")
  add_custom_command(
    OUTPUT ${sources} ${headers}
    COMMAND ${FASTDDSGEN} ${flags} -replace -d ${dir} ${CMAKE_CURRENT_SOURCE_DIR}/${idl} > ${dir}/fastddsgen.log
    DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${idl}
    COMMENT "fastddsgen ${idl}"
    VERBATIM)
  add_library(${target} OBJECT ${sources} ${headers})
  tfdude_compile_together(${target})
  target_include_directories(${target} SYSTEM PUBLIC ${dir})
  target_link_libraries(${target} PUBLIC tfdude_fastdds)
  set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  # For an empty sequence Fast CDR 1 calls a member of a null array, which is harmless.
  target_compile_options(${target} PRIVATE -w -fno-sanitize=null)
endfunction()
