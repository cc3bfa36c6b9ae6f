/* solidtex.h is C99, and a C program can link the library. */
#include <solidtex/solidtex.h>
#include <stdio.h>
#include <string.h>

int main(void) {
  uint64_t limit = 0;
  solidtex_texture* texture = solidtex_new();
  if (solidtex_get_integer(texture, "cache_limit_bytes", &limit) != SOLIDTEX_OK) return 1;
  if (limit == 0) return 2;
  if (solidtex_open(texture, "no such model") != SOLIDTEX_IO_ERROR) return 3;
  if (strstr(solidtex_error_message(), "no such model") == NULL) return 4;
  printf("solidtex %s: %s\n", solidtex_version(), solidtex_error_message());
  solidtex_release(texture);
  return 0;
}
