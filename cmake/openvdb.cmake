# Finds OpenVDB, the target solidtex_openvdb; SOLIDTEX_OPENVDB_VERSION is empty where there is none.
# SOLIDTEX_NANOVDB_INCLUDE is set where there are the headers of NanoVDB.
# Not through OpenVDB's own module: it insists on boost_iostreams, which the library does not need.
set(SOLIDTEX_OPENVDB_VERSION "")
find_path(SOLIDTEX_OPENVDB_INCLUDE openvdb/openvdb.h)
find_library(SOLIDTEX_OPENVDB_LIBRARY openvdb)
find_path(SOLIDTEX_NANOVDB_INCLUDE nanovdb/NanoVDB.h)
mark_as_advanced(SOLIDTEX_OPENVDB_INCLUDE SOLIDTEX_OPENVDB_LIBRARY SOLIDTEX_NANOVDB_INCLUDE)
if(SOLIDTEX_OPENVDB_INCLUDE AND SOLIDTEX_OPENVDB_LIBRARY)
  file(STRINGS ${SOLIDTEX_OPENVDB_INCLUDE}/openvdb/version.h lines
       REGEX "define OPENVDB_LIBRARY_(MAJOR|MINOR|PATCH)_VERSION_NUMBER [0-9]+")
  string(REGEX MATCHALL "[0-9]+" numbers "${lines}")
  list(JOIN numbers . SOLIDTEX_OPENVDB_VERSION)
  find_package(TBB REQUIRED)
  find_package(Imath REQUIRED)
  if(NOT TARGET solidtex_openvdb)
    add_library(solidtex_openvdb INTERFACE)
    target_include_directories(solidtex_openvdb SYSTEM INTERFACE ${SOLIDTEX_OPENVDB_INCLUDE})
    target_link_libraries(solidtex_openvdb INTERFACE ${SOLIDTEX_OPENVDB_LIBRARY} TBB::tbb
                          Imath::Imath)
  endif()
endif()
