# Cpack runs this over the folder that it packs: a .deb has its copyright file, its news and its
# manual pages where, and as, Debian's policy wants them (chapter 12).
if(NOT CPACK_GENERATOR STREQUAL "DEB")
  return()
endif()
set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY}${CPACK_PACKAGING_INSTALL_PREFIX})
set(documents ${root}/share/doc/solidtex)
configure_file(${CPACK_SOLIDTEX_SOURCE}/setup/packaging/debian/copyright ${documents}/copyright
               COPYONLY)
file(REMOVE ${documents}/LICENSE)
configure_file(${CPACK_SOLIDTEX_SOURCE}/CHANGELOG.md ${documents}/NEWS COPYONLY)
file(GLOB pages ${root}/share/man/man1/*.1)
execute_process(COMMAND gzip -9n ${documents}/NEWS ${pages} COMMAND_ERROR_IS_FATAL ANY)
