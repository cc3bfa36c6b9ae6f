# Looks for ONNX Runtime: its headers, for engine/space/encoder.cpp, and its library, which libsolidtex
# loads when it encodes a photograph and not before. Sets SOLIDTEX_ONNXRUNTIME_INCLUDE,
# SOLIDTEX_ONNXRUNTIME_NAME, the file name of the library, and SOLIDTEX_ONNXRUNTIME_FILE, its path.
#
# setup/common.sh puts both into the folder build where the system has none. A library from there
# lies in a folder solidtex beside libsolidtex, in the build tree and in an installation, where no
# other program finds it. Wheels hold either.
set(bundle ${PROJECT_BINARY_DIR}/onnxruntime)
if(SKBUILD)
  set(bundle ${PROJECT_SOURCE_DIR}/build/onnxruntime)
endif()
find_path(SOLIDTEX_ONNXRUNTIME_INCLUDE onnxruntime_cxx_api.h HINTS ${bundle}/include
          PATH_SUFFIXES onnxruntime)
find_library(SOLIDTEX_ONNXRUNTIME_LIBRARY onnxruntime)
mark_as_advanced(SOLIDTEX_ONNXRUNTIME_INCLUDE SOLIDTEX_ONNXRUNTIME_LIBRARY)
file(GLOB bundled ${bundle}/lib/libonnxruntime.so.*)
set(SOLIDTEX_ONNXRUNTIME_NAME libonnxruntime.so.1)
set(SOLIDTEX_ONNXRUNTIME_FILE "${bundled}" CACHE INTERNAL "")
if(NOT SOLIDTEX_ONNXRUNTIME_INCLUDE)
  message(STATUS "ONNX Runtime: off, onnxruntime_cxx_api.h was not found; photographs cannot be "
                 "encoded. SOLIDTEX_ONNXRUNTIME_INCLUDE is the folder of the header; on Debian "
                 "demo.sh installs it for solidtex alone")
elseif(bundled)
  message(STATUS "ONNX Runtime: ${bundled}")
  set(private ${CMAKE_LIBRARY_OUTPUT_DIRECTORY}/solidtex)
  file(MAKE_DIRECTORY ${private})
  file(CREATE_LINK ${bundled} ${private}/${SOLIDTEX_ONNXRUNTIME_NAME} SYMBOLIC)
  if(SOLIDTEX_INSTALL)
    install(FILES ${bundled} DESTINATION ${CMAKE_INSTALL_LIBDIR}/solidtex
            RENAME ${SOLIDTEX_ONNXRUNTIME_NAME})
  endif()
elseif(SOLIDTEX_ONNXRUNTIME_LIBRARY)
  message(STATUS "ONNX Runtime: ${SOLIDTEX_ONNXRUNTIME_LIBRARY}")
  file(REAL_PATH ${SOLIDTEX_ONNXRUNTIME_LIBRARY} library)
  cmake_path(GET library FILENAME SOLIDTEX_ONNXRUNTIME_NAME)
  set(SOLIDTEX_ONNXRUNTIME_FILE ${library} CACHE INTERNAL "")
else()
  message(STATUS "ONNX Runtime: headers in ${SOLIDTEX_ONNXRUNTIME_INCLUDE}, no library; encoding "
                 "works where libonnxruntime.so.1 is found at run time")
endif()
