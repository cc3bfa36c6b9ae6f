// Parts of the model reader: the document, and the architecture of each family.
#pragma once

#include "engine/model/checks.h"
#include "engine/model/container.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// Reads everything except the architecture.
void read_document(const Fields& document, Model& model);

LatticeModel read_lattice(const Fields& lattice, const Model& model, TensorSource& tensors);
SamplerModel read_sampler(const Fields& sampler, const Model& model, TensorSource& tensors);

// Throws if one voxel needs too many values or operations.
void check_voxel_cost(const Fields& lattice, const std::vector<Node>& nodes);

}  // namespace solidtex::engine
