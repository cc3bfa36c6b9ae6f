# Builds the clone that this file lies in. The library is a shared one: it exports solidtex.h alone.
vcpkg_check_linkage(ONLY_DYNAMIC_LIBRARY)
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../../.." ABSOLUTE)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}" OPTIONS
  -DSOLIDTEX_BUILD_OPENIMAGEIO=OFF -DSOLIDTEX_BUILD_PYTHON=OFF -DSOLIDTEX_BUILD_RENDERER=OFF
  -DSOLIDTEX_BUILD_TESTS=OFF -DSOLIDTEX_BUILD_TOOLS=OFF -DSOLIDTEX_HARDENED=ON)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/solidtex)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
