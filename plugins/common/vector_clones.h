// SOLIDTEX_VECTOR_CLONES before a function: the compiler makes it for several instruction sets, and
// the loader takes the one of the machine. A loop has the same bits in each, since nothing is
// fused.
#pragma once

#if defined(__x86_64__) && !defined(SOLIDTEX_SANITIZED)
#define SOLIDTEX_VECTOR_CLONES __attribute__((target_clones("default", "avx2", "arch=x86-64-v4")))
#else
#define SOLIDTEX_VECTOR_CLONES
#endif
