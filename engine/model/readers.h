// The parts of reading a model: the document, and one architecture per family.
#pragma once

#include "engine/model/checks.h"
#include "engine/model/container.h"
#include "engine/model/model.h"

namespace solidtex::engine {

// Reads everything but the architecture into `model`.
void read_document(const Fields& document, Model& model);

LatticeModel read_lattice(const Fields& lattice, const Model& model, TensorSource& tensors);
SamplerModel read_sampler(const Fields& sampler, const Model& model, TensorSource& tensors);

// Throws when one voxel would need too many values or operations.
void check_voxel_cost(const Fields& lattice, const std::vector<Node>& nodes);

}  // namespace solidtex::engine
