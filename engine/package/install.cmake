# Installs the library, its headers, and what find_package() and pkg-config read. Nothing here holds
# an absolute path: an installation can be moved.
include(CMakePackageConfigHelpers)

install(TARGETS solidtex EXPORT solidtexTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/include/solidtex ${generated_include}/solidtex
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})

set(config_folder ${CMAKE_INSTALL_LIBDIR}/cmake/solidtex)
set(solidtex_models ${CMAKE_INSTALL_DATADIR}/solidtex/models)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/solidtexConfig.cmake.in
  solidtexConfig.cmake INSTALL_DESTINATION ${config_folder} PATH_VARS solidtex_models)
write_basic_package_version_file(solidtexConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(EXPORT solidtexTargets NAMESPACE solidtex:: DESTINATION ${config_folder})
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/solidtexConfig.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/solidtexConfigVersion.cmake DESTINATION ${config_folder})

file(RELATIVE_PATH prefix_from_pc ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
foreach(folder libdir includedir)
  string(TOUPPER ${folder} upper)
  file(RELATIVE_PATH ${folder}_from_prefix ${CMAKE_INSTALL_PREFIX} ${CMAKE_INSTALL_FULL_${upper}})
endforeach()
file(RELATIVE_PATH models_from_prefix ${CMAKE_INSTALL_PREFIX}
     ${CMAKE_INSTALL_FULL_DATADIR}/solidtex/models)
configure_file(${CMAKE_CURRENT_LIST_DIR}/solidtex.pc.in solidtex.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/solidtex.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
