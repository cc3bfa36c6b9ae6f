// Bakes a volume to a Zarr store, shard by shard, in bounded memory. Goes on with what is there.
#pragma once

#include "tools/bake/options.h"
#include "tools/bake/volume.h"

namespace solidtex::tools {

// True for --format zarr, or a name that ends in .zarr.
bool is_store(const BakeOptions& options);

// Throws for options that make no sense for a store, and for a store's with another output.
void check_store_options(const BakeOptions& options);

void bake_store(const BakeOptions& options, const Volume& volume);

}  // namespace solidtex::tools
