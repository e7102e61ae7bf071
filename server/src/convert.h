// amhex.v1 messages to and from the engine's types; the only file that includes both worlds.
#pragma once

#include "absl/status/status.h"
#include "amhex/mesher.h"
#include "amhex/v1/job.pb.h"
#include "amhex/v1/params.pb.h"
#include "worker/worker_protocol.pb.h"

namespace amhex::server {

// Absent fields and UNSPECIFIED values take the engine's defaults.
MeshingParams ToEngine(const amhex::v1::MeshingParams& params);
// Every field is present in the answer.
amhex::v1::MeshingParams ToProto(const MeshingParams& params);

// Enum values the engine does not know, and a negative seed, each as "path: description".
std::vector<std::pair<std::string, std::string>> UnknownValues(
    const amhex::v1::MeshingParams& params);

amhex::v1::Stage ToProto(Stage stage);
amhex::v1::Progress ToProto(const Progress& progress);
amhex::v1::StageReport ToProto(const StageReport& report);
amhex::v1::MeshStatistics ToProto(const MeshStatistics& statistics);
amhex::v1::CostEstimate ToProto(const CostEstimate& estimate);
amhex::v1::BackendInfo ToProto(const BackendInfo& info);
// All but the blob and its encoding.
amhex::v1::MeshingResult ToProto(const MeshingResult& result);

}  // namespace amhex::server
