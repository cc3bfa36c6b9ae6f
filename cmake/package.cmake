# `cpack` in the build folder writes a .tar.gz, and where dpkg-shlibdeps is found (Debian's dpkg-dev)
# a .deb that depends on the system's packages.
set(CPACK_GENERATOR TGZ)
find_program(SOLIDTEX_DPKG_SHLIBDEPS dpkg-shlibdeps)
if(SOLIDTEX_DPKG_SHLIBDEPS)
  list(APPEND CPACK_GENERATOR DEB)
endif()
set(CPACK_PACKAGE_CONTACT "the solidtex authors <solidtex@users.noreply.github.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"Trained on one photograph of a material, a small network gives its color
at every point of a solid, without seams and without repetition. The
package has programs that bake volumes and textures of meshes, render
scenes and measure speed, the library with its C and C++ interface, and
trained models. Training is another package, in Python.")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# The programs find the library of this package in the build.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
# libsolidtex loads ONNX Runtime when it encodes a photograph, so dpkg-shlibdeps does not see it.
if(SOLIDTEX_DPKG_SHLIBDEPS AND SOLIDTEX_ONNXRUNTIME_FILE)
  execute_process(COMMAND dpkg-query --search ${SOLIDTEX_ONNXRUNTIME_FILE}
                  OUTPUT_VARIABLE owner ERROR_QUIET)
  if(owner MATCHES "^([^:]+):")
    set(CPACK_DEBIAN_PACKAGE_RECOMMENDS ${CMAKE_MATCH_1})
  endif()
endif()
set(CPACK_SOLIDTEX_SOURCE ${PROJECT_SOURCE_DIR})
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/debian.cmake)
include(CPack)
