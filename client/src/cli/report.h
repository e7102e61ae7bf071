// What a finished job says: to people, to scripts, and inside the mesh file.
#pragma once

#include <string>
#include <vector>

#include "amhex/v1/job.pb.h"
#include "amhex/v1/meshing_service.pb.h"
#include "formats/mesh_file.h"

namespace amhex::client {

// Where the input came from and how it travelled.
struct InputNote {
  std::string path;
  std::string description;  // "12946 triangles, 6475 vertices"
  std::string encoding;     // "positions quantised to 14 bits, error at most 3.1e-4"
};

// Lines for the terminal: cells by type, quality, distances, time, warnings.
std::string SummaryOf(const amhex::v1::Job& job);

// The whole outcome as JSON: job, state, input, statistics, stages, parameters, warnings; or the
// error of a job that has none of these.
std::string JsonOf(const amhex::v1::Job& job, const InputNote& input, double seconds);

// Field data for .vtu files: statistics.*, parameters.*, timings.<stage> in seconds, and texts.
std::vector<MeshFact> FactsOfJob(const amhex::v1::Job& job);

// How the relaxation went, as far as its frames were seen.
class ConvergenceRecord {
 public:
  void OnFrame(const amhex::v1::WatchJobResponse& frame);
  // "convergence.iteration" and "convergence.movement", lists of equal length; none if empty.
  std::vector<MeshFact> Facts() const;

 private:
  std::vector<double> iterations_, movements_;
};

}  // namespace amhex::client
