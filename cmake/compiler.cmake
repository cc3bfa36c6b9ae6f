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
