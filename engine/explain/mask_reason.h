// Why an instance is masked.
#pragma once

#include "engine/step/instance_batch.h"

namespace cab {

// The reason for one given instance of a batch that is bound to its input; without a cause if it takes part.
MaskReason mask_reason(const InstanceBatch& batch, std::uint32_t instance);

}  // namespace cab
