/* Prints what a compiled host knows of the library's structs and enumerations. */
#include <solidtex/solidtex.h>
#include <stdio.h>

#define SIZE(type) printf("size " #type " %u\n", (unsigned)sizeof(type))
#define OFFSET(type, member) \
  printf("offset " #type "." #member " %u\n", (unsigned)offsetof(type, member))
#define VALUE(name) printf("value " #name " %d\n", (int)name)

int main(void) {
  SIZE(solidtex_status);
  VALUE(SOLIDTEX_OK);
  VALUE(SOLIDTEX_INVALID_ARGUMENT);
  VALUE(SOLIDTEX_IO_ERROR);
  VALUE(SOLIDTEX_INVALID_MODEL);
  VALUE(SOLIDTEX_OUT_OF_MEMORY);
  VALUE(SOLIDTEX_INTERNAL_ERROR);
  VALUE(SOLIDTEX_CANCELLED);
  VALUE(SOLIDTEX_UNAVAILABLE);
  SIZE(solidtex_family);
  VALUE(SOLIDTEX_FAMILY_LATTICE);
  VALUE(SOLIDTEX_FAMILY_FIELD);
  VALUE(SOLIDTEX_FAMILY_SAMPLER);
  SIZE(solidtex_patches);
  VALUE(SOLIDTEX_PATCHES_AVERAGE);
  VALUE(SOLIDTEX_PATCHES_MEDOID);
  SIZE(solidtex_footprints);
  OFFSET(solidtex_footprints, struct_size);
  OFFSET(solidtex_footprints, radii);
  OFFSET(solidtex_footprints, axes);
  SIZE(solidtex_statistics);
  OFFSET(solidtex_statistics, struct_size);
  OFFSET(solidtex_statistics, point_count);
  OFFSET(solidtex_statistics, voxel_count);
  OFFSET(solidtex_statistics, hit_count);
  OFFSET(solidtex_statistics, miss_count);
  OFFSET(solidtex_statistics, brick_count);
  OFFSET(solidtex_statistics, brick_nanoseconds);
  OFFSET(solidtex_statistics, resident_bytes);
  OFFSET(solidtex_statistics, peak_bytes);
  OFFSET(solidtex_statistics, scratch_bytes);
  OFFSET(solidtex_statistics, peak_scratch_bytes);
  SIZE(solidtex_token);
  OFFSET(solidtex_token, struct_size);
  OFFSET(solidtex_token, progress_callback);
  OFFSET(solidtex_token, user);
  return 0;
}
