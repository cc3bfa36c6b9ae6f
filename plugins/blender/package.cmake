# Writes the Blender extension as a zip that Blender 4.2 and later install:
#
#   cmake [-D OUT=solidtex-blender.zip] -P plugins/blender/package.cmake
set(blender ${CMAKE_CURRENT_LIST_DIR})
file(STRINGS ${blender}/../../CMakeLists.txt line LIMIT_COUNT 1 REGEX "^project\\(solidtex VERSION")
string(REGEX MATCH "[0-9]+\\.[0-9]+\\.[0-9]+" SOLIDTEX_VERSION "${line}")
if(NOT OUT)
  set(OUT solidtex-blender-${SOLIDTEX_VERSION}.zip)
endif()
get_filename_component(OUT ${OUT} ABSOLUTE)

set(folder ${OUT}.folder)
file(REMOVE_RECURSE ${folder})
configure_file(${blender}/extension/blender_manifest.toml.in ${folder}/blender_manifest.toml @ONLY)
file(GLOB sources ${blender}/extension/*.py)
file(COPY ${sources} ${blender}/extension/thumbnails ${blender}/solidtex_atlas.py
          ${blender}/solidtex_osl.py ${blender}/solidtex_vdb.py
          ${blender}/../openimageio/solidtex.osl ${blender}/../../LICENSE
     DESTINATION ${folder})
file(GLOB names RELATIVE ${folder} ${folder}/*)
execute_process(COMMAND ${CMAKE_COMMAND} -E tar cf ${OUT} --format=zip ${names}
                WORKING_DIRECTORY ${folder} COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE_RECURSE ${folder})
message(STATUS "${OUT}")
