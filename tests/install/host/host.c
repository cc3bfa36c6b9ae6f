/* A host outside the source tree: opens a model, prints values with all their bits. */
#include <solidtex/solidtex.h>
#include <stdio.h>
#include <stdlib.h>

enum { POINTS = 5, EDGE = 3, MAX_CHANNELS = 64 };

static void check(solidtex_status status) {
  if (status == SOLIDTEX_OK) return;
  fprintf(stderr, "error: %s\n", solidtex_error_message());
  exit(1);
}

static void print_values(const char* what, const float* values, size_t count, size_t channels) {
  size_t i;
  for (i = 0; i < count * channels; ++i) {
    printf("%s%a", i % channels == 0 ? what : " ", (double)values[i]);
    if (i % channels == channels - 1) printf("\n");
  }
}

int main(int argc, char** argv) {
  static float values[EDGE * EDGE * EDGE * MAX_CHANNELS];
  const double origin[3] = {1e9, -20.5, 0.25};
  const float points[3 * POINTS] = {0, 0, 0, 1.5f, 2.5f, 3.5f, -7, 8, 9.75f, 100, 0, 3, -1, -1, -1};
  const int64_t corner[3] = {-2, 1 << 30, 5}, size[3] = {EDGE, EDGE, EDGE};
  solidtex_texture* texture = NULL;
  size_t channels;

  texture = solidtex_new();
  check(solidtex_open(texture, argc > 1 ? argv[1] : "granite-grey"));
  channels = solidtex_channel_count(texture);
  if (channels == 0 || channels > MAX_CHANNELS) return 2;
  printf("solidtex %s, %s, %u channels\n", solidtex_version(), solidtex_name(texture),
         (unsigned)channels);
  check(solidtex_eval_points(texture, origin, points, POINTS, values, NULL));
  print_values("point ", values, POINTS, channels);
  check(solidtex_eval_box(texture, corner, size, values));
  print_values("voxel ", values, (size_t)EDGE * EDGE * EDGE, channels);
  solidtex_release(texture);
  return 0;
}
