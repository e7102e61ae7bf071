// What a relaxation takes where its bodies run, told before there are sites.
#pragma once

#include <cstdint>

#include "amhex/params.h"

namespace amhex {

// For about `cell_count` cells of a solid that fills the share `fill` of its box: roughly what
// RelaxationBytes says once the sites are there. Solids with much surface have more sites outside.
int64_t ExpectedRelaxationBytes(int64_t cell_count, double fill, const RelaxationParams& params);

}  // namespace amhex
