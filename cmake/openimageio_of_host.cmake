# Makes a prefix in which find_package(OpenImageIO) finds the OpenImageIO of a host that brings the
# library without its headers, as Blender's and OpenImageIO's own Python wheels do:
#
#   cmake -D SOURCE=openimageio-3.0.19.1 -D LIBRARY=.../libOpenImageIO.so.3.0 -D PREFIX=oiio-3.0
#         -P cmake/openimageio_of_host.cmake
#
# SOURCE is OpenImageIO's unpacked source archive of the host's version, whose headers are taken.
# One of them is a template that OpenImageIO's own configuration fills in; that needs all of its
# dependencies, so it is filled in here. fmt (libfmt-dev) stays where it is installed.
foreach(argument SOURCE LIBRARY PREFIX)
  if(NOT ${argument})
    message(FATAL_ERROR "-D ${argument}=... is missing; see the head of ${CMAKE_SCRIPT_MODE_FILE}")
  endif()
  get_filename_component(${argument} ${${argument}} ABSOLUTE)
endforeach()
set(headers ${SOURCE}/src/include/OpenImageIO)
foreach(needed ${LIBRARY} ${SOURCE}/CMakeLists.txt ${headers}/oiioversion.h.in)
  if(NOT EXISTS ${needed})
    message(FATAL_ERROR "${needed}: there is no such file, expected a library of OpenImageIO and "
                        "the source archive of its version, 3.0 or later")
  endif()
endforeach()

file(STRINGS ${SOURCE}/CMakeLists.txt line LIMIT_COUNT 1 REGEX "set \\(OpenImageIO_VERSION \"")
if(NOT line MATCHES "\"(([0-9]+)\\.([0-9]+)\\.([0-9]+)\\.([0-9]+))\"")
  message(FATAL_ERROR "${SOURCE}/CMakeLists.txt: no set (OpenImageIO_VERSION \"...\"), "
                      "expected the source archive of OpenImageIO 3.0 or later")
endif()
set(version ${CMAKE_MATCH_1})
# The names that the template asks for.
set(PROJECT_VERSION_MAJOR ${CMAKE_MATCH_2})
set(PROJECT_VERSION_MINOR ${CMAKE_MATCH_3})
set(PROJECT_VERSION_PATCH ${CMAKE_MATCH_4})
set(PROJECT_VERSION_TWEAK ${CMAKE_MATCH_5})
set(PROJ_NAME OIIO)
set(PROJ_NAMESPACE OpenImageIO)
set(PROJ_VERSION_NAMESPACE v${CMAKE_MATCH_2}_${CMAKE_MATCH_3})
set(PROJ_NAMESPACE_V ${PROJ_NAMESPACE}_${PROJ_VERSION_NAMESPACE})
set(CMAKE_CXX_STANDARD 17)
set(Imath_VERSION_MAJOR 3)
set(Imath_VERSION_MINOR 1)
set(OIIO_TBB 0)
set(OIIO_USE_COMPILED_FMT_VALUE 0)

# The namespace is in the names of the library's symbols: a library of another version, or one that
# was built with other names, is found out here and not when the host passes over the plugin.
file(STRINGS ${LIBRARY} symbol LIMIT_COUNT 1
     REGEX "${PROJ_NAMESPACE}(_|[0-9]+)${PROJ_VERSION_NAMESPACE}")
if(NOT symbol)
  message(FATAL_ERROR "${LIBRARY}: no symbols of ${PROJ_VERSION_NAMESPACE}, "
                      "expected the library that ${SOURCE} is the source of")
endif()

file(COPY ${headers} DESTINATION ${PREFIX}/include FILES_MATCHING PATTERN "*.h")
configure_file(${headers}/oiioversion.h.in ${PREFIX}/include/OpenImageIO/oiioversion.h)
foreach(header format ostream printf std)
  file(WRITE ${PREFIX}/include/OpenImageIO/detail/fmt/${header}.h "#include <fmt/${header}.h>\n")
endforeach()
# Links in a folder of their own: beside the host's library there are others, such as TBB, that the
# linker must not take for the system's.
get_filename_component(folder ${LIBRARY} DIRECTORY)
get_filename_component(library ${LIBRARY} NAME)
string(REPLACE OpenImageIO OpenImageIO_Util utilities ${library})
file(MAKE_DIRECTORY ${PREFIX}/lib)
foreach(name ${library} ${utilities})
  file(CREATE_LINK ${folder}/${name} ${PREFIX}/lib/${name} SYMBOLIC)
endforeach()
file(WRITE ${PREFIX}/lib/cmake/OpenImageIO/OpenImageIOConfig.cmake "\
include(CMakeFindDependencyMacro)
find_dependency(Imath)
find_dependency(fmt)
add_library(OpenImageIO::OpenImageIO SHARED IMPORTED)
set_target_properties(OpenImageIO::OpenImageIO PROPERTIES
  IMPORTED_LOCATION \"${PREFIX}/lib/${library}\"
  INTERFACE_INCLUDE_DIRECTORIES \"${PREFIX}/include\"
  INTERFACE_SYSTEM_INCLUDE_DIRECTORIES \"${PREFIX}/include\"
  INTERFACE_LINK_LIBRARIES \"${PREFIX}/lib/${utilities};Imath::Imath;fmt::fmt-header-only\")
")
file(WRITE ${PREFIX}/lib/cmake/OpenImageIO/OpenImageIOConfigVersion.cmake
     "set(PACKAGE_VERSION ${version})\n")
message(STATUS "OpenImageIO ${version} of ${LIBRARY}: configure with -D OpenImageIO_ROOT=${PREFIX}")
