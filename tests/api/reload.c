/* A host loads the library by name, queries a model and unloads the library, again and again, on
 * its main thread and on others: reload LIBRARY MODEL. oneTBB's workers outlive each of the
 * queries. */
#include <dlfcn.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { ROUNDS = 4, EDGE = 64, POINTS = 1000 };

typedef struct solidtex_texture solidtex_texture;
typedef solidtex_texture* (*new_function)(void);
typedef void (*release_function)(solidtex_texture*);
typedef int (*open_function)(solidtex_texture*, const char*);
typedef int (*box_function)(const solidtex_texture*, const int64_t*, const int64_t*, float*);
typedef int (*points_function)(const solidtex_texture*, const double*, const float*, size_t, float*,
                               float*);
typedef size_t (*count_function)(const solidtex_texture*);

static const char *library, *model;

/* A pointer to a function, which C99 keeps apart from pointers to objects. */
static void find(void* handle, const char* name, void* function) {
  *(void**)function = dlsym(handle, name);
  if (*(void**)function == NULL) {
    fprintf(stderr, "%s has no %s\n", library, name);
    exit(1);
  }
}

static void require(int condition, const char* what) {
  if (condition) return;
  fprintf(stderr, "failed: %s\n", what);
  exit(1);
}

static void* load_query_unload(void* unused) {
  const int64_t origin[3] = {0, 0, 0}, size[3] = {EDGE, EDGE, EDGE};
  new_function make;
  release_function release;
  open_function open_model;
  box_function eval_box;
  points_function eval_points;
  count_function channel_count;
  solidtex_texture* texture;
  float *values, *points;
  size_t channels, i;
  void* handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  (void)unused;
  require(handle != NULL, "dlopen");
  find(handle, "solidtex_new", &make);
  find(handle, "solidtex_release", &release);
  find(handle, "solidtex_open", &open_model);
  find(handle, "solidtex_eval_box", &eval_box);
  find(handle, "solidtex_eval_points", &eval_points);
  find(handle, "solidtex_channel_count", &channel_count);
  texture = make();
  require(open_model(texture, model) == 0, "solidtex_open");
  channels = channel_count(texture);
  values = (float*)malloc(sizeof(float) * EDGE * EDGE * EDGE * channels);
  points = (float*)malloc(sizeof(float) * 3 * POINTS);
  for (i = 0; i < 3 * POINTS; ++i) points[i] = (float)(i * 7919 % 1009);
  require(eval_box(texture, origin, size, values) == 0, "solidtex_eval_box");
  require(eval_points(texture, NULL, points, POINTS, values, NULL) == 0, "solidtex_eval_points");
  release(texture);
  free(values);
  free(points);
  dlclose(handle);
  usleep(50000); /* workers go to sleep, and wake for the next query */
  return NULL;
}

int main(int argc, char** argv) {
  int round;
  if (argc != 3) return 2;
  library = argv[1];
  model = argv[2];
  for (round = 0; round < ROUNDS; ++round) {
    pthread_t thread;
    load_query_unload(NULL);
    require(pthread_create(&thread, NULL, load_query_unload, NULL) == 0, "pthread_create");
    pthread_join(thread, NULL);
  }
  sleep(1); /* long enough for a worker to leave */
  return 0;
}
