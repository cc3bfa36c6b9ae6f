/* solidtex.h is C99, and a C program can link the library. */
#include <solidtex/solidtex.h>
#include <stdio.h>
#include <string.h>

int main(void) {
  char version[64];
  uint64_t limit = 0;
  solidtex_texture* texture = solidtex_new();
  sprintf(version, "%d.%d.%d", SOLIDTEX_VERSION / 10000, SOLIDTEX_VERSION / 100 % 100,
          SOLIDTEX_VERSION % 100);
  if (strcmp(version, SOLIDTEX_VERSION_STRING) != 0) return 5;
  if (strcmp(version, solidtex_version()) != 0) return 6;
  if (solidtex_get_integer(texture, "cache_limit_bytes", &limit) != SOLIDTEX_OK) return 1;
  if (limit == 0) return 2;
  if (solidtex_open(texture, "no such model") != SOLIDTEX_IO_ERROR) return 3;
  if (strstr(solidtex_error_message(), "no such model") == NULL) return 4;
  printf("solidtex %s: %s\n", solidtex_version(), solidtex_error_message());
  solidtex_release(texture);
  return 0;
}
