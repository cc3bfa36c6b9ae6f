#include "plugins/transport/laplace.h"

namespace solidtex::transport {

TransportResult diffusivity(const VoxelImage& image, const DiffusionSettings& settings,
                            const Progress& progress) {
  const PoreSpace space(image, settings.axis, settings.boundary);
  TransportResult result;
  result.conducting_voxels = space.count();
  if (space.count() == 0) return result;
  const Laplace laplace(space);
  const std::vector<double> potential =
      laplace.solve(settings.tolerance, settings.max_steps, progress, result);
  // The flux through a layer for a gradient of 1 / length.
  result.value = laplace.total_flux(potential) * static_cast<double>(image.size[settings.axis]) /
                 voxels_of(image);
  return result;
}

}  // namespace solidtex::transport
