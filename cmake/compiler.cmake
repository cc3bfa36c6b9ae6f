# Warnings and floating-point rules that every target shares.
# -ffp-contract=off: a fused multiply-add happens only where the code says so, because the same bits
# must come from every instruction set.
add_library(solidtex_compiler INTERFACE)
target_compile_options(solidtex_compiler INTERFACE -Wall -Wextra -Wpedantic -ffp-contract=off)
set(SOLIDTEX_SANITIZE "" CACHE STRING "Sanitizers, e.g. address,undefined or thread")
if(SOLIDTEX_SANITIZE)
  add_compile_options(-fsanitize=${SOLIDTEX_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SOLIDTEX_SANITIZE})
  add_compile_definitions(SOLIDTEX_SANITIZED)
endif()
# Releases check the use of the C and C++ libraries as they run, guard their stacks, and cannot
# change their tables of functions once loaded. Emscripten and sanitizers have their own.
if(SOLIDTEX_HARDENED AND NOT SOLIDTEX_SANITIZE AND NOT EMSCRIPTEN)
  include(CheckPIESupported)
  check_pie_supported()
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  add_compile_options(-fstack-protector-strong)
  # Debug is not optimized, and _FORTIFY_SOURCE warns there. Some compilers set another level.
  add_compile_options("$<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
  add_link_options(LINKER:-z,relro LINKER:-z,now)
endif()
