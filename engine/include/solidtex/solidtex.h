/* solidtex: solid textures learned from one photograph, evaluated anywhere in 3D space.
 *
 * This is the whole interface of libsolidtex (C99). Make a texture, set its parameters, open a
 * model, ask for points or for a box of voxels, release it. solidtex.hpp wraps it for C++.
 *
 * Space. Coordinates are texels: one texel is one exemplar pixel. Voxel (i,j,k) covers
 * [i,i+1) x [j,j+1) x [k,k+1), its centre is (i+0.5, j+0.5, k+0.5). Coordinates may be negative and
 * far away; they are meant for |c| <= 2^30.
 *
 * Determinism. A value depends on the file, the seed, the precision and the position only: the same
 * bits come from any box, batch, order, thread count and instruction set (instruction set: in full
 * precision).
 *
 * Threads. An open texture does not change: any number of threads may query, retain and release it
 * at once. What comes before, from solidtex_new to solidtex_open, is for one thread at a time.
 *
 * Errors. A function that can fail returns a status, or NULL or 0; the message is the thread's.
 */
#ifndef SOLIDTEX_H
#define SOLIDTEX_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define SOLIDTEX_API __declspec(dllexport)
#else
#define SOLIDTEX_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum solidtex_status {
  SOLIDTEX_OK = 0,
  SOLIDTEX_INVALID_ARGUMENT = 1, /* a null pointer, a size or a coordinate out of range */
  SOLIDTEX_IO_ERROR = 2,         /* the file cannot be found or read */
  SOLIDTEX_INVALID_MODEL = 3,    /* the file was read but is no valid model */
  SOLIDTEX_OUT_OF_MEMORY = 4,
  SOLIDTEX_INTERNAL_ERROR = 5,
  SOLIDTEX_CANCELLED = 6 /* the host has stopped the query */
} solidtex_status;

/* A texture: parameters, and the model once it is open. Opaque, counted by references. */
typedef struct solidtex_texture solidtex_texture;

/* Kind of model. */
typedef enum solidtex_family {
  SOLIDTEX_FAMILY_LATTICE = 0, /* voxels are evaluated in blocks; points are interpolated */
  SOLIDTEX_FAMILY_SAMPLER = 1, /* every point is evaluated exactly */
  SOLIDTEX_FAMILY_FIELD = SOLIDTEX_FAMILY_LATTICE /* old name */
} solidtex_family;

/* Library version as "major.minor.patch". Never fails. */
SOLIDTEX_API const char* solidtex_version(void);

/* The instruction set that values are computed with, by Highway's name ("AVX3", "AVX2", "NEON").
 * It is the best that the machine has, or the one that the environment variable SOLIDTEX_TARGET
 * names, to compare them or to keep off a slow one: read once, by this call or the first
 * solidtex_open; a name that the machine does not have is an error of either (here NULL), which
 * lists those it has. It holds for everything in the process that uses the same Highway library. */
SOLIDTEX_API const char* solidtex_target(void);

/* Message of the first error on this thread since the last solidtex_clear_error, "" if none. The
 * pointer stays valid until this thread's next call into the library. */
SOLIDTEX_API const char* solidtex_error_message(void);
SOLIDTEX_API solidtex_status solidtex_error_status(void);
SOLIDTEX_API void solidtex_clear_error(void);

/* A texture that is not open yet, with one reference; NULL if there is no memory. */
SOLIDTEX_API solidtex_texture* solidtex_new(void);

/* One reference more, and one less: the last one frees the texture, when no query on it may be
 * running. NULL is allowed and does nothing. */
SOLIDTEX_API void solidtex_retain(solidtex_texture* texture);
SOLIDTEX_API void solidtex_release(solidtex_texture* texture);

/* Parameters by name, until the texture is open; then setting one is an error. So is a name that is
 * not there, and the message lists those that are. Numbers:
 *   "seed"               which of the endless variants of the material: any; 0 at first
 *   "cache_limit_bytes"  bound on the bricks that the lattice family keeps; 268435456 (256 MiB)
 *   "threads"            0, the default: queries run in the calling thread's oneTBB arena, so that
 *                        the host's tbb::task_arena bounds them. 1 to 1024: in an arena of the
 *                        texture's own of so many slots, the calling thread's among them. A thread
 *                        that finds it full waits, and a worker may run its query and callbacks.
 * Texts:
 *   "precision"  "full", the default: float32 throughout. "fast": sampler family, where the
 *                processor has a matrix unit for bfloat16 (Intel AMX, Linux): more than twice as
 *                fast, for pictures of 8 bits: 99.9 % of a texture's values lie within 1/255 of
 *                full precision (docs/numerics.md: all of those of the shipped models, their
 *                largest error is 0.4/255). Lattice family, other processors: the same as full. */
SOLIDTEX_API solidtex_status solidtex_set_integer(solidtex_texture* texture, const char* name,
                                                  uint64_t value);
SOLIDTEX_API solidtex_status solidtex_set_string(solidtex_texture* texture, const char* name,
                                                 const char* value);

/* Reads one, set or not, open or not. A string lives until it is set again, or the texture's end.
 * On failure *value is 0 or NULL. */
SOLIDTEX_API solidtex_status solidtex_get_integer(const solidtex_texture* texture, const char* name,
                                                  uint64_t* value);
SOLIDTEX_API solidtex_status solidtex_get_string(const solidtex_texture* texture, const char* name,
                                                 const char** value);

/* Told of every call with this texture that fails, on the thread that made it, before it returns.
 * NULL for none, as at first; to be set before the texture is open. It throws nothing. */
typedef void (*solidtex_error_callback)(void* user, solidtex_status status, const char* message);
SOLIDTEX_API solidtex_status solidtex_set_error_callback(solidtex_texture* texture,
                                                         solidtex_error_callback told, void* user);

/* Told how much of a query is done, from 0 to 1 and never less than before; not zero stops it. NULL
 * for none, as at first; to be set before the texture is open. It throws nothing.
 * A query of more than one block, brick or batch tells it when it begins and then every 50 ms or so
 * (a thread's next query waits for that, too), between two of them, on the thread that called; of
 * the end it says nothing. When stopped it ends with SOLIDTEX_CANCELLED: some of its values are
 * written then, all bricks that were completed stay in the cache. */
typedef int (*solidtex_progress_callback)(void* user, double done);
SOLIDTEX_API solidtex_status solidtex_set_progress_callback(solidtex_texture* texture,
                                                            solidtex_progress_callback told,
                                                            void* user);

/* Opens a model. `model` is a path to a .solidtex file or the bare name of a shipped one
 * ("granite-grey"), looked up in SOLIDTEX_MODEL_PATH (colon-separated folders), then in
 * share/solidtex/models of the installation. On failure the texture stays as it was and may be
 * opened again; one that is open may not. */
SOLIDTEX_API solidtex_status solidtex_open(solidtex_texture* texture, const char* model);

/* Opens a model that is already in memory (the bytes of a .solidtex file); they are copied. */
SOLIDTEX_API solidtex_status solidtex_open_memory(solidtex_texture* texture, const void* bytes,
                                                  size_t byte_size);

/* Facts about an open texture. The strings live as long as it does; NULL or 0 on bad arguments. */
SOLIDTEX_API solidtex_family solidtex_get_family(const solidtex_texture* texture);
SOLIDTEX_API size_t solidtex_channel_count(const solidtex_texture* texture);
SOLIDTEX_API const char* solidtex_channel_name(const solidtex_texture* texture, size_t channel);
SOLIDTEX_API const char* solidtex_color_space(
    const solidtex_texture* texture); /* srgb|linear|data */
SOLIDTEX_API const char* solidtex_name(const solidtex_texture* texture);
/* The model's whole metadata document (docs/file-format.md) as JSON text. */
SOLIDTEX_API const char* solidtex_metadata_json(const solidtex_texture* texture);
/* Number of float parameters stored in the file. */
SOLIDTEX_API uint64_t solidtex_parameter_count(const solidtex_texture* texture);
/* Path the model was opened from, "" for one opened from memory. */
SOLIDTEX_API const char* solidtex_path(const solidtex_texture* texture);

/* Evaluates `count` points. Point p is origin + (points[3p], points[3p+1], points[3p+2]), added in
 * double precision; `origin` (3 doubles) may be NULL for zero. Writes count x channels floats, in
 * the file's own colour space, not clamped. The field family is reconstructed between voxel centres
 * by cubic convolution (Keys 1981, a = -3/4), through the brick cache; near edges values reach
 * a little beyond those of the voxels around.
 * gradients: where not NULL, count x channels x 3 floats, how each value changes along x, y and z,
 * in values a texel: the derivatives of what is returned, exact but for rounding. Values are
 * continuous; in the sampler family, on the face between two cells of its noise, it is the
 * derivative of either. In the field family it is continuous, too.
 * Full precision then computes the values, too. Four times the work of values alone in the sampler
 * family, six times for one point a call; a third more in the field family, where bricks are there
 * already. */
SOLIDTEX_API solidtex_status solidtex_eval_points(const solidtex_texture* texture,
                                                  const double* origin, const float* points,
                                                  size_t count, float* values, float* gradients);

/* The same, filtered for a footprint: the mean of the texture over a cube around each point, whose
 * edge is twice the point's radius in texels, from 0 (the point itself, the bits of
 * solidtex_eval_points) to infinity (the mean of the material). Albedo that is encoded as sRGB is
 * averaged as light, and is not below zero. It is an approximation, meant to keep pictures from
 * aliasing; docs/filtering.md says how near it comes. Field family: from a pyramid of means in
 * bricks of their own, edges of more than 8 texels predicted from those of 8. Sampler family:
 * octaves fade that are finer than the footprint, in full precision. The first call with a
 * footprint measures the material, some tenths of a second. Gradients, NULL for none, are those of
 * the mean for a footprint that moves with its point and stays as large; albedo that is not above
 * zero has none. */
SOLIDTEX_API solidtex_status solidtex_eval_filtered(const solidtex_texture* texture,
                                                    const double* origin, const float* points,
                                                    const float* radii, size_t count, float* values,
                                                    float* gradients);

/* The same for footprints that are longer than wide, as a pixel's is on a surface seen at a slant:
 * the mean of the texture over the points point + u a + v b + w c, u, v and w uniform in [-1, 1].
 * axes: nine floats for each point, a, b and c as x, y, z in texels. They are half the edges of a
 * parallelepiped, of any directions; with one axis of zeros it is a parallelogram, with two a line,
 * with three the point itself (the bits of solidtex_eval_points). The axes (r,0,0), (0,r,0),
 * (0,0,r) give the bits of solidtex_eval_filtered with the radius r; the order and the signs of
 * axes do not matter, but for rounding. An axis of 4096 texels or more, infinity included, gives
 * the mean of the material; a NaN is refused.
 * What is longer than wide is cut into parts, whose values are averaged. Field family: 16 at most,
 * each looked up as a cube. Sampler family: 8 evaluations at most, each with octaves that fade
 * along the axes. docs/filtering.md says how near it comes. */
SOLIDTEX_API solidtex_status solidtex_eval_footprints(const solidtex_texture* texture,
                                                      const double* origin, const float* points,
                                                      const float* axes, size_t count,
                                                      float* values, float* gradients);

/* Evaluates the voxels [origin, origin + size) at their centres: size[0] x size[1] x size[2] x
 * channels floats, index order [x][y][z][channel], the channel fastest. Large boxes are evaluated
 * in parallel blocks. */
SOLIDTEX_API solidtex_status solidtex_eval_box(const solidtex_texture* texture,
                                               const int64_t origin[3], const int64_t size[3],
                                               float* values);

/* What a texture has done so far. Those of bricks are zero for the sampler family. */
typedef struct solidtex_statistics {
  size_t struct_size;         /* set to sizeof(solidtex_statistics) before the call */
  uint64_t point_count;       /* points answered, with footprints or without */
  uint64_t voxel_count;       /* voxels of boxes answered */
  uint64_t hit_count;         /* bricks found in the cache */
  uint64_t miss_count;        /* bricks computed */
  uint64_t brick_count;       /* different bricks computed: fewer than miss_count where the bound
                                 of the cache made it forget some that were needed again */
  uint64_t brick_nanoseconds; /* time spent computing bricks, added up over the threads */
  uint64_t resident_bytes;    /* held by the cache now */
  uint64_t peak_bytes;        /* most ever held */
} solidtex_statistics;
SOLIDTEX_API solidtex_status solidtex_get_statistics(const solidtex_texture* texture,
                                                     solidtex_statistics* statistics);

#ifdef __cplusplus
}
#endif
#endif
