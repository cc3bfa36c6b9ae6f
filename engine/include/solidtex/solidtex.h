/* solidtex: solid textures learned from one photograph, evaluated anywhere in 3D space.
 *
 * This header is the whole C99 interface of libsolidtex; solidtex.hpp wraps it for C++. A host
 * creates a texture, sets its parameters, opens a model, evaluates points or boxes of voxels, and
 * releases the texture. docs/api.md shows complete programs.
 *
 * Space. Coordinates are texels: one texel is one pixel of the exemplar. Voxel (i, j, k) covers
 * [i, i+1) x [j, j+1) x [k, k+1); its center is (i + 0.5, j + 0.5, k + 0.5). Coordinates may be
 * negative. Their magnitude is at most 2^30 + 2^16.
 *
 * Values. A value is one float per channel in the color space of the file, not clamped.
 *
 * Determinism. A value depends only on the file, the seed, the precision and the position. The bits
 * are the same for every box, batch, order of queries and thread count, and in full precision for
 * every instruction set.
 *
 * Threads. An open texture is immutable: any number of threads may query, retain and release it at
 * once. A texture that is not open yet belongs to one thread.
 *
 * Errors. A function that can fail returns a status, NULL or 0. Each thread keeps the message of
 * its first error.
 *
 * Memory. The caller owns all arrays it passes. The texture owns all strings it returns.
 */
#ifndef SOLIDTEX_H
#define SOLIDTEX_H

#include <solidtex/version.h>
#include <stddef.h>
#include <stdint.h>

#if !defined(_WIN32)
#define SOLIDTEX_API __attribute__((visibility("default")))
#elif defined(SOLIDTEX_BUILDING_LIBRARY)
#define SOLIDTEX_API __declspec(dllexport)
#else
#define SOLIDTEX_API __declspec(dllimport)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Result of a call. */
typedef enum solidtex_status {
  SOLIDTEX_OK = 0,
  SOLIDTEX_INVALID_ARGUMENT = 1, /* an argument is NULL or out of range */
  SOLIDTEX_IO_ERROR = 2,         /* the file cannot be found or read */
  SOLIDTEX_INVALID_MODEL = 3,    /* the file is not a valid model or texture space */
  SOLIDTEX_OUT_OF_MEMORY = 4,
  SOLIDTEX_INTERNAL_ERROR = 5,
  SOLIDTEX_CANCELLED = 6,  /* the progress callback cancelled the query */
  SOLIDTEX_UNAVAILABLE = 7 /* an optional library is missing; the message names it */
} solidtex_status;

/* Texture: its parameters and, once it is open, its model. Opaque and reference-counted. */
typedef struct solidtex_texture solidtex_texture;

/* Family of a model, or of the models of a texture space. */
typedef enum solidtex_family {
  SOLIDTEX_FAMILY_LATTICE = 0,                    /* computes voxels, interpolates points */
  SOLIDTEX_FAMILY_SAMPLER = 1,                    /* computes every point exactly */
  SOLIDTEX_FAMILY_NONE = 2,                       /* of a space: it makes no models */
  SOLIDTEX_FAMILY_FIELD = SOLIDTEX_FAMILY_LATTICE /* deprecated name */
} solidtex_family;

/* ---- Library ---------------------------------------------------------------------------------*/

/* Returns the version of the library as "major.minor.patch". SOLIDTEX_VERSION_STRING is the version
 * of this header. */
SOLIDTEX_API const char* solidtex_version(void);

/* Returns the name of the instruction set in use, as Highway spells it ("AVX3", "AVX2", "NEON").
 * This is the best one of the machine unless the environment variable SOLIDTEX_TARGET names
 * another. The library reads the variable once, in the first call of this function or
 * solidtex_open. Both fail while it names an instruction set that the machine lacks; the message
 * lists the available ones. The choice applies to every user of the same Highway library in the
 * process. */
SOLIDTEX_API const char* solidtex_target(void);

/* Returns the names that solidtex_open finds in SOLIDTEX_MODEL_PATH and among the installed models,
 * sorted, one a line; an empty string for none. Valid until the next call of this function on the
 * same thread. Returns null when memory runs out. */
SOLIDTEX_API const char* solidtex_model_names(void);

/* ---- Errors ----------------------------------------------------------------------------------*/

/* Returns the message of this thread's first error since solidtex_clear_error, "" if there is none.
 * The string is valid until this thread's next call into the library. */
SOLIDTEX_API const char* solidtex_error_message(void);

/* Returns the status of this thread's first error since solidtex_clear_error. */
SOLIDTEX_API solidtex_status solidtex_error_status(void);

/* Clears this thread's error. */
SOLIDTEX_API void solidtex_clear_error(void);

/* ---- Texture ---------------------------------------------------------------------------------*/

/* Creates a texture with one reference. It is not open yet. Returns NULL if memory is short. */
SOLIDTEX_API solidtex_texture* solidtex_new(void);

/* Retains the texture: increments its reference count. Ignores NULL. */
SOLIDTEX_API void solidtex_retain(solidtex_texture* texture);

/* Releases the texture: decrements its reference count. The last release frees the texture; no
 * query on it may be running then. Ignores NULL. */
SOLIDTEX_API void solidtex_release(solidtex_texture* texture);

/* Sets a parameter of a texture that is not open yet. An unknown name is an error, and the message
 * lists the known ones.
 *
 * Integers:
 *   "seed"               Random seed, any value. Default 0.
 *   "cache_limit_bytes"  Memory bound of the brick cache (lattice family). Default 256 MiB.
 *   "threads"            0, the default: queries use the oneTBB arena of the calling thread.
 *                        1 to 1024: queries use an arena of the texture's own with this many slots,
 *                        including the caller's. A caller that finds the arena full waits, and a
 *                        worker thread may run its query and its callbacks.
 *   "period"             0: no period. Or texels after which a lattice repeats on every axis, bit
 *                        by bit: a multiple of the pitch of the coarsest level, up to 2^30. The
 *                        mean of the material stays that of the solid without a period.
 * Strings:
 *   "precision"          "full", the default: float32. "fast": bfloat16 products where a sampler
 *                        finds a matrix unit (Intel AMX), else "full". See docs/numerics.md. */
SOLIDTEX_API solidtex_status solidtex_set_integer(solidtex_texture* texture, const char* name,
                                                  uint64_t value);
SOLIDTEX_API solidtex_status solidtex_set_string(solidtex_texture* texture, const char* name,
                                                 const char* value);

/* Gets a parameter, whether the texture is open or not. A string is valid until the parameter is
 * set again or the texture is freed. On failure *value is 0 or NULL. */
SOLIDTEX_API solidtex_status solidtex_get_integer(const solidtex_texture* texture, const char* name,
                                                  uint64_t* value);
SOLIDTEX_API solidtex_status solidtex_get_string(const solidtex_texture* texture, const char* name,
                                                 const char** value);

/* Error callback. The library calls it on the failing thread before the failing call returns. It
 * must not throw. */
typedef void (*solidtex_error_callback)(void* user, solidtex_status status, const char* message);

/* Sets the error callback of a texture that is not open yet. NULL, the default, means none. */
SOLIDTEX_API solidtex_status solidtex_set_error_callback(solidtex_texture* texture,
                                                         solidtex_error_callback callback,
                                                         void* user);

/* Progress callback. `done` is the finished fraction of the query, from 0 to 1; it never decreases.
 * Return 0 to continue and any other value to cancel the query. It must not throw. */
typedef int (*solidtex_progress_callback)(void* user, double done);

/* Sets the progress callback of a texture that is not open yet. NULL, the default, means none.
 *
 * A query calls it on the calling thread: when the query begins, then about every 50 ms. A step
 * that cannot be divided, such as an operation on one block of a lattice, comes first: on one
 * thread that may take a second. Calls are at least 50 ms apart across the queries of a thread,
 * too: short queries in a row share them. A query that is one block, brick or batch never calls
 * it, and no query calls it at its end.
 *
 * A cancelled query returns SOLIDTEX_CANCELLED. It may have written some of its values. Completed
 * bricks stay in the cache. */
SOLIDTEX_API solidtex_status solidtex_set_progress_callback(solidtex_texture* texture,
                                                            solidtex_progress_callback callback,
                                                            void* user);

/* Opens a model. `model` is the path of a .solidtex file or the bare name of a model, such as
 * "granite-grey". The library looks for a name in the colon-separated folders of the environment
 * variable SOLIDTEX_MODEL_PATH, then in share/solidtex/models beside the library, then in that of
 * the prefix it was built for. A texture opens once; a failure leaves it free to be opened. */
SOLIDTEX_API solidtex_status solidtex_open(solidtex_texture* texture, const char* model);

/* Opens a model from memory: the bytes of a .solidtex file. The library copies them. */
SOLIDTEX_API solidtex_status solidtex_open_memory(solidtex_texture* texture, const void* bytes,
                                                  size_t byte_size);

/* ---- Facts about an open texture -------------------------------------------------------------*/
/* Strings are valid as long as the texture. On failure these return NULL or 0. */

/* Returns the family of the model. */
SOLIDTEX_API solidtex_family solidtex_get_family(const solidtex_texture* texture);

/* Returns the number of channels. */
SOLIDTEX_API size_t solidtex_channel_count(const solidtex_texture* texture);

/* Returns the name of a channel, such as "albedo.r" or "roughness". */
SOLIDTEX_API const char* solidtex_channel_name(const solidtex_texture* texture, size_t channel);

/* Returns the color space of the albedo: "srgb", "linear" or "data". */
SOLIDTEX_API const char* solidtex_color_space(const solidtex_texture* texture);

/* Returns the name of the material. */
SOLIDTEX_API const char* solidtex_name(const solidtex_texture* texture);

/* Returns the metadata document of the model as JSON text. See docs/file-format.md. */
SOLIDTEX_API const char* solidtex_metadata_json(const solidtex_texture* texture);

/* Returns the number of float parameters in the file. */
SOLIDTEX_API uint64_t solidtex_parameter_count(const solidtex_texture* texture);

/* Returns the path of the model, "" if it was opened from memory. */
SOLIDTEX_API const char* solidtex_path(const solidtex_texture* texture);

/* ---- Queries ---------------------------------------------------------------------------------*/

/* Footprints of the points of a query: the volumes over which the texture is averaged. Initialize
 * the struct with zeros, set struct_size, and set one of the two pointers.
 *
 * radii  One float per point: half the edge of an axis-aligned cube, in texels. This is the same as
 *        the axes (r, 0, 0), (0, r, 0), (0, 0, r). 0 is the point itself, INFINITY the mean of the
 *        material.
 * axes   Nine floats per point: the half edges a, b and c of a parallelepiped, each as x, y, z in
 *        texels. The footprint is point + u a + v b + w c with u, v, w in [-1, 1]. With one zero
 *        axis it is a parallelogram, with two a line, with three the point itself. Order and sign
 *        of the axes change no more than rounding. An axis of 4096 texels or more, INFINITY
 *        included, gives the mean of the material. */
typedef struct solidtex_footprints {
  size_t struct_size; /* sizeof(solidtex_footprints) */
  const float* radii; /* `count` floats or NULL */
  const float* axes;  /* 9 x `count` floats or NULL */
} solidtex_footprints;

/* Evaluates the texture at `count` points.
 *
 * origin      Three doubles, or NULL for zero.
 * points      3 x `count` floats. Position p is origin + (points[3p], points[3p+1], points[3p+2]),
 *             added in double precision.
 * footprints  Volumes to average over, or NULL for none. A footprint that is a point gives the bits
 *             of an evaluation without footprints.
 * values      Receives `count` x channels floats.
 * jacobians   Receives `count` x channels x 3 floats, or is NULL: derivatives along x, y and z, in
 *             values per texel. A footprint moves with its point and keeps its shape.
 *
 * Without footprints a sampler is exact, and a lattice is reconstructed between voxel centers by
 * cubic convolution. Means over footprints are approximations. Albedo in sRGB is averaged as light
 * and is never negative. The first call with footprints measures the material. See
 * docs/filtering.md.
 *
 * Jacobians are the exact derivatives of the returned values. Where a value has an edge they are
 * those of one side. A call with jacobians computes in full precision. */
SOLIDTEX_API solidtex_status solidtex_eval(const solidtex_texture* texture, const double* origin,
                                           const float* points,
                                           const solidtex_footprints* footprints, size_t count,
                                           float* values, float* jacobians);

/* Evaluates the voxels [origin, origin + size) at their centers. Writes size[0] x size[1] x size[2]
 * x channels floats in the order [x][y][z][channel], the channel fastest. */
SOLIDTEX_API solidtex_status solidtex_eval_box(const solidtex_texture* texture,
                                               const int64_t origin[3], const int64_t size[3],
                                               float* values);

/* Token of one query: progress and cancellation of its own, beside those of its texture. Initialize
 * the struct with zeros and set struct_size. */
typedef struct solidtex_token {
  size_t struct_size;                           /* sizeof(solidtex_token) */
  solidtex_progress_callback progress_callback; /* called as the texture's is, or NULL */
  void* user;                                   /* first argument of progress_callback */
} solidtex_token;

/* The same queries with a token, or with NULL for none. The texture's callback is called first;
 * either one cancels the query. */
SOLIDTEX_API solidtex_status solidtex_eval_with_token(const solidtex_texture* texture,
                                                      const double* origin, const float* points,
                                                      const solidtex_footprints* footprints,
                                                      size_t count, float* values, float* jacobians,
                                                      const solidtex_token* token);
SOLIDTEX_API solidtex_status solidtex_eval_box_with_token(const solidtex_texture* texture,
                                                          const int64_t origin[3],
                                                          const int64_t size[3], float* values,
                                                          const solidtex_token* token);

#ifndef SOLIDTEX_BUILDING_LIBRARY
/* Evaluates points without footprints. */
static inline solidtex_status solidtex_eval_points(const solidtex_texture* texture,
                                                   const double* origin, const float* points,
                                                   size_t count, float* values, float* jacobians) {
  return solidtex_eval(texture, origin, points, NULL, count, values, jacobians);
}

/* Evaluates points with one radius each. */
static inline solidtex_status solidtex_eval_filtered(const solidtex_texture* texture,
                                                     const double* origin, const float* points,
                                                     const float* radii, size_t count,
                                                     float* values, float* jacobians) {
  solidtex_footprints footprints = {sizeof(solidtex_footprints), NULL, NULL};
  footprints.radii = radii;
  return solidtex_eval(texture, origin, points, &footprints, count, values, jacobians);
}

/* Evaluates points with three axes each. */
static inline solidtex_status solidtex_eval_footprints(const solidtex_texture* texture,
                                                       const double* origin, const float* points,
                                                       const float* axes, size_t count,
                                                       float* values, float* jacobians) {
  solidtex_footprints footprints = {sizeof(solidtex_footprints), NULL, NULL};
  footprints.axes = axes;
  return solidtex_eval(texture, origin, points, &footprints, count, values, jacobians);
}
#endif

/* ---- Texture spaces --------------------------------------------------------------------------*/
/* A texture space is a network that has learned many materials. A code, a few numbers, names a
 * material of the space; most spaces also need its colors. Code and colors decode to an ordinary
 * model: it costs what any model costs. docs/spaces.md shows how to use spaces.
 *
 * A space of the family SOLIDTEX_FAMILY_NONE is an encoder alone. It encodes photographs, to
 * compare them; functions that decode a material fail with SOLIDTEX_INVALID_MODEL.
 *
 * Decoding uses the same operations in the same order everywhere: the same code and colors give the
 * same model on every machine.
 *
 * Colors are 12 floats: rows of [basis | mean], color[r] = mean[r] + sum of basis[r][k] y[k] for a
 * value y of the network. Where solidtex_space_has_colors returns 0, functions ignore colors, and
 * they may be NULL. */

/* Texture space. Opaque, reference-counted, immutable: any number of threads may use it. */
typedef struct solidtex_space solidtex_space;

/* Opens a texture space. `space` is the path of a .solidtex-space file or a bare name, such as
 * "stones", which is looked for where models are. Returns a space with one reference, or NULL. */
SOLIDTEX_API solidtex_space* solidtex_space_open(const char* space);

/* Retains the space: increments its reference count. Ignores NULL. */
SOLIDTEX_API void solidtex_space_retain(solidtex_space* space);

/* Releases the space. The last release frees it; its textures stay valid. Ignores NULL. */
SOLIDTEX_API void solidtex_space_release(solidtex_space* space);

/* Facts about a space. Strings are valid as long as the space. On failure these return NULL or 0.
 */

/* Returns the name of the space. */
SOLIDTEX_API const char* solidtex_space_name(const solidtex_space* space);

/* Returns the path of the file. */
SOLIDTEX_API const char* solidtex_space_path(const solidtex_space* space);

/* Returns the SHA-256 of the file as 64 hexadecimal digits. Models record it. */
SOLIDTEX_API const char* solidtex_space_sha256(const solidtex_space* space);

/* Returns the metadata document of the space as JSON text. See docs/space-format.md. */
SOLIDTEX_API const char* solidtex_space_metadata_json(const solidtex_space* space);

/* Returns the family of the models of the space, SOLIDTEX_FAMILY_NONE for an encoder alone. */
SOLIDTEX_API solidtex_family solidtex_space_family(const solidtex_space* space);

/* Returns the number of floats in a code. */
SOLIDTEX_API size_t solidtex_space_code_size(const solidtex_space* space);

/* Returns 1 if a material has colors beside its code, otherwise 0. */
SOLIDTEX_API int solidtex_space_has_colors(const solidtex_space* space);

/* Returns the side of the encoder's patches in pixels: the least side of a photograph. */
SOLIDTEX_API size_t solidtex_space_patch_size(const solidtex_space* space);

/* Returns the resolution: photographs are reduced so that the shorter side has at most this many
 * pixels. One pixel is one texel. */
SOLIDTEX_API size_t solidtex_space_resolution(const solidtex_space* space);

/* Returns the number of training photographs, at least 1. */
SOLIDTEX_API size_t solidtex_space_photograph_count(const solidtex_space* space);

/* Returns the name of a training photograph. */
SOLIDTEX_API const char* solidtex_space_photograph_name(const solidtex_space* space, size_t index);

/* Gets the code and the colors of a training photograph. Either may be NULL. */
SOLIDTEX_API solidtex_status solidtex_space_photograph(const solidtex_space* space, size_t index,
                                                       float* code, float* colors);

/* How patches of a photograph become one code. */
typedef enum solidtex_patches {
  SOLIDTEX_PATCHES_AVERAGE = 0, /* mean of the patches' codes */
  SOLIDTEX_PATCHES_MEDOID = 1   /* code of the patch that is nearest to all others */
} solidtex_patches;

/* Encodes a photograph. Needs ONNX Runtime, which is loaded by the first call: the library beside
 * libsolidtex, else the system's, or the one that the environment variable SOLIDTEX_ONNXRUNTIME
 * names; SOLIDTEX_UNAVAILABLE without it. Loading it sets ORT_DISABLE_TELEMETRY=1 where that is not
 * set, or it would send reports; a host whose threads read the environment sets it before.
 * The photograph is reduced to the space's resolution, and turned if the space has grain along z
 * ("xy") and its own runs along rows. Patches on a grid that reaches all corners are encoded. The
 * last bits of a code depend on the machine.
 *
 * pixels  width x height x 3 floats, rows from the top, sRGB-encoded, 0 to 1.
 * width, height  At least solidtex_space_patch_size each.
 * code    Receives code size floats.
 * colors  Receives 12 floats. */
SOLIDTEX_API solidtex_status solidtex_space_encode(const solidtex_space* space, const float* pixels,
                                                   size_t width, size_t height,
                                                   solidtex_patches patches, float* code,
                                                   float* colors);

/* Blends materials. Codes, and means and covariances of colors, are blended linearly. The weights
 * are divided by their sum, which must be positive.
 *
 * count          Number of materials, at least 1.
 * weights        `count` doubles.
 * codes          `count` x code size floats.
 * colors         `count` x 12 floats.
 * code           Receives code size floats.
 * blended_colors Receives 12 floats. */
SOLIDTEX_API solidtex_status solidtex_space_blend(const solidtex_space* space, size_t count,
                                                  const double* weights, const float* codes,
                                                  const float* colors, float* code,
                                                  float* blended_colors);

/* Opens `texture`, which is not open yet, with the material of a code. Its values have the bits of
 * the file that solidtex_space_write_model writes.
 *
 * details   JSON object with the keys "name", "license", "exemplar" and "training" of the model's
 *           document (docs/file-format.md), each optional, or NULL. The library adds
 *           "training"."space": name, SHA-256 and license of the space, code and colors. */
SOLIDTEX_API solidtex_status solidtex_space_texture(const solidtex_space* space, const float* code,
                                                    const float* colors, const char* details,
                                                    solidtex_texture* texture);

/* Writes the material of a code as a .solidtex file. It replaces an existing file as a whole: a
 * failed write leaves the older one. A process that is killed meanwhile may leave PATH.tmp-*. */
SOLIDTEX_API solidtex_status solidtex_space_write_model(const solidtex_space* space,
                                                        const float* code, const float* colors,
                                                        const char* details, const char* path);

/* Computes the SHA-256 of a file's bytes, as a model's exemplar records it: 64 hexadecimal digits
 * and a final zero. The file may have any size. */
SOLIDTEX_API solidtex_status solidtex_file_sha256(const char* path, char digest[65]);

/* ---- Statistics ------------------------------------------------------------------------------*/

/* Work that a texture has done so far. Brick counts are zero for the sampler family. */
typedef struct solidtex_statistics {
  size_t struct_size;         /* sizeof(solidtex_statistics) */
  uint64_t point_count;       /* points evaluated */
  uint64_t voxel_count;       /* voxels of boxes evaluated */
  uint64_t hit_count;         /* bricks found in the cache */
  uint64_t miss_count;        /* bricks computed */
  uint64_t brick_count;       /* distinct bricks computed; less than miss_count if the cache evicted
                                 bricks that were needed again */
  uint64_t brick_nanoseconds; /* time spent computing bricks, summed over threads */
  uint64_t resident_bytes;    /* size of the cache now */
  uint64_t peak_bytes;        /* largest size of the cache */
  uint64_t scratch_bytes;     /* size of the queries' scratch memory now: planes that each thread
                                 keeps for its next query (lattice family), and what running queries
                                 hold of points; lists below 4 KiB are not counted */
  uint64_t peak_scratch_bytes; /* largest size of the scratch memory */
} solidtex_statistics;

/* Gets the statistics of an open texture. Initialize the struct with zeros and set struct_size. */
SOLIDTEX_API solidtex_status solidtex_get_statistics(const solidtex_texture* texture,
                                                     solidtex_statistics* statistics);

/* Structs and versions. A library accepts a struct of an older header: members that it lacks are
 * zero on input and are not written on output. It accepts a struct of a newer header if all bytes
 * beyond its own struct are zero; otherwise the call fails. */

#ifdef __cplusplus
}
#endif
#endif
