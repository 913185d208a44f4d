# Installs the library as the CMake package "tfdude" (find_package(tfdude), target tfdude::tfdude), the programs, and
# the files that they need at run time.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/tfdude)

install(TARGETS tfdude EXPORT tfdudeTargets FILE_SET HEADERS)
install(EXPORT tfdudeTargets NAMESPACE tfdude:: DESTINATION ${package_dir})
configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/tfdudeConfig.cmake.in
  ${CMAKE_BINARY_DIR}/tfdudeConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/tfdudeConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/tfdudeConfig.cmake ${CMAKE_BINARY_DIR}/tfdudeConfigVersion.cmake
  DESTINATION ${package_dir})

# The programs find the library by a path relative to themselves, so the prefix may be moved.
file(RELATIVE_PATH bin_to_lib ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
foreach(program tfduded tfdude_cli tfdude_ros tfdude_web)
  if(TARGET ${program})
    set_target_properties(${program} PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
    install(TARGETS ${program})
  endif()
endforeach()
# What tfdude becomes.
file(RELATIVE_PATH libexec_to_lib ${CMAKE_INSTALL_FULL_LIBEXECDIR}/tfdude ${CMAKE_INSTALL_FULL_LIBDIR})
set_target_properties(tfdude_whole PROPERTIES INSTALL_RPATH "$ORIGIN/${libexec_to_lib}")
install(TARGETS tfdude_whole DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/tfdude)

foreach(folder profiles examples)
  if(EXISTS ${CMAKE_SOURCE_DIR}/${folder})
    install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_DATADIR}/tfdude USE_SOURCE_PERMISSIONS)
  endif()
endforeach()
if(TARGET tfdude_web)
  install(DIRECTORY apps/tfdude-web/page/ DESTINATION ${CMAKE_INSTALL_DATADIR}/tfdude/web)
endif()
install(FILES apps/tfdude/completion.bash RENAME tfdude
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES apps/tfdude/completion.zsh RENAME _tfdude DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
install(FILES apps/tfdude/completion.fish RENAME tfdude.fish
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(DIRECTORY ${CMAKE_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
configure_file(systemd/tfduded@.service.in ${CMAKE_BINARY_DIR}/systemd/tfduded@.service @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/systemd/tfduded@.service systemd/tfdude.target DESTINATION lib/systemd/system)
# Where examples/other-dds and examples/ros look for them.
install(FILES idl/tfdude.idl idl/ros2.idl DESTINATION ${CMAKE_INSTALL_DATADIR}/tfdude/idl)
# What the answers of tfdude --json look like.
install(FILES docs/cli.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/tfdude)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tfdude)
