# With TFDUDE_UNITY the files of a folder are compiled together, sixteen at once, because most of the time goes into the
# headers and templates that they share. A whole build takes much less time then, and a changed file more; so
# scripts/build --programs does it for a first build, and so does continuous integration. All other builds, that of
# Debian 13 and the preset dev among them, compile each file alone. Names in unnamed namespaces are unique in a folder,
# which tests/check_unity.py checks. Tests may share such names; tests/join_files.py keeps them apart.
option(TFDUDE_UNITY "Compile the files of a folder together" OFF)

# tfdude_compile_together(target [files]): at most so many at once; by default sixteen.
function(tfdude_compile_together target)
  if(NOT TFDUDE_UNITY)
    return()
  endif()
  set(together 16)
  if(ARGC GREATER 1)
    set(together ${ARGV1})
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    get_filename_component(folder ${source} DIRECTORY)
    string(MAKE_C_IDENTIFIER "in_${folder}" folder)
    list(LENGTH ${folder} before)
    math(EXPR group "${before} / ${together}")
    list(APPEND ${folder} ${source})
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder}_${group})
  endforeach()
endfunction()
