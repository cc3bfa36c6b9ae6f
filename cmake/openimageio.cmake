# Looks for OpenImageIO, the target OpenImageIO::OpenImageIO, and sets OpenImageIO_FOUND.
# Debian's package names OpenCV's header folder even where OpenCV is not installed, which CMake
# refuses; include folders that do not exist are dropped.
find_package(OpenImageIO QUIET)
if(OpenImageIO_FOUND)
  foreach(property INTERFACE_INCLUDE_DIRECTORIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES)
    get_target_property(folders OpenImageIO::OpenImageIO ${property})
    set(existing "")
    foreach(folder IN LISTS folders)
      if(EXISTS ${folder})
        list(APPEND existing ${folder})
      endif()
    endforeach()
    set_target_properties(OpenImageIO::OpenImageIO PROPERTIES ${property} "${existing}")
  endforeach()
endif()
