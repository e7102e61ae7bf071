// Every number a job may choose. Mirrored one to one by proto/amhex/v1/params.proto.
//
// Defaults work untouched. `Validate` is the only place that checks ranges.
#pragma once

#include <cstdint>

#include "absl/status/status.h"

namespace amhex {

enum class Backend : uint8_t { kAuto = 0, kCpu = 1, kCuda = 2 };

// Where the relaxation's sites come from.
enum class Initialization : uint8_t {
  kField = 0,         // orientation, size and phase fields (not in the paper; the default)
  kGrid = 1,          // regular grid, section 4.1
  kJitteredGrid = 2,  // jittered grid, section 4.1
};

struct SizingParams {
  // Wanted number of cells; 0 = derive from edge_length or, if that is 0 too, from the input.
  int64_t cell_count = 0;  // [0, 20'000'000]
  // Wanted edge length in the user's units; 0 = derive. At most one of the two may be set.
  double edge_length = 0.0;  // [0, inf)
  // The most lattices of slightly different density that are tried, within 9 % of the wanted number
  // of cells; the mesh comes from the one that fits the solid best, and none is tried after one
  // that fits it everywhere. 1 = none but the one asked for; 0 = the more the smaller the solid.
  // Only the field start has more than one.
  int32_t trial_count = 0;  // [0, 12]
};

// What a volume mesh is used for; no other input looks at this.
enum class VolumeUse : uint8_t {
  kReassemble = 0,  // its cells are broken down and reassembled, no vertex moves (the default)
  kHull = 1,        // only its boundary is taken, as if it had been sent as a surface
  kSubdivide = 2,   // a hexahedron around every corner of every cell; no vertex moves
};

struct InputParams {
  // Dihedral angle above which an input edge counts as sharp and is kept, in degrees.
  double sharp_angle_degrees = 35.0;  // [10, 180]; 180 keeps none
  VolumeUse volume_use = VolumeUse::kReassemble;
};

struct RelaxationParams {
  Initialization initialization = Initialization::kField;
  // Lloyd iterations; -1 = 0 after the field start (it needs none), 150 after the grids
  // (paper, 6.2).
  int32_t iteration_count = -1;  // [-1, 1000]
  // Lattice points per site of the Voronoi labelling; the paper uses 12^3.
  int32_t lattice_points_per_site = 108;  // [8, 4096]
  // Peak of the regularity weight w(p), eq. 4.
  double regularity_weight = 1.0;  // [0, 1]
  // A site claimed as neighbour by at least this many sites is split, section 4.4.
  int32_t split_limit = 10;  // [7, 26]
  // Displacement of jittered grid sites, in edge lengths.
  double jitter = 0.2;  // [0, 0.5]
};

// Where the assembled primitives come from.
enum class Extraction : uint8_t {
  kDirect = 0,  // cubes that are cells already; graph search only around the rest (the default)
  kPaper = 1,   // graph search over all faces, section 5.2
};

struct AssemblyParams {
  // Lowest scaled Jacobian a primitive may have when cells are accepted (minQ of listing 3).
  double min_quality = 0.25;  // [0.01, 0.9]
  Extraction extraction = Extraction::kDirect;
};

struct RunParams {
  Backend backend = Backend::kAuto;
  int32_t thread_count = 0;        // [0, 1024]; 0 = all cores
  uint64_t seed = 1;               // every random choice derives from it
  int64_t memory_limit_bytes = 0;  // [0, inf); 0 = no limit of its own
};

struct MeshingParams {
  SizingParams sizing;
  InputParams input;
  RelaxationParams relaxation;
  AssemblyParams assembly;
  RunParams run;
};

// INVALID_ARGUMENT naming the field, the value and the permitted range; all bad fields at once,
// joined by "; ".
absl::Status Validate(const MeshingParams& params);

}  // namespace amhex
