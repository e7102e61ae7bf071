// Stands in for the engine, which is not part of what is fuzzed.
#include "amhex/mesher.h"

namespace amhex {

std::string EngineVersion() { return "none"; }

}  // namespace amhex
