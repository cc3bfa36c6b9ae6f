/* solidtex.h is C99, and a C program can link the library. */
#include <solidtex/solidtex.h>
#include <stdio.h>
#include <string.h>

int main(void) {
  solidtex_options options;
  solidtex_texture* texture = NULL;
  solidtex_options_init(&options);
  if (options.struct_size != sizeof options || options.cache_limit_bytes == 0) return 1;
  if (solidtex_open("no such model", &options, &texture) != SOLIDTEX_IO_ERROR) return 2;
  if (strstr(solidtex_error_message(), "no such model") == NULL) return 3;
  printf("solidtex %s: %s\n", solidtex_version(), solidtex_error_message());
  return 0;
}
