// What the service's tests share: temporary folders, scripts as inputs, hostile files, waiting.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "absl/time/time.h"
#include "amhex/v1/meshing_service.pb.h"

namespace amhex::server {

// A fresh folder, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

// An input in INPUT_ENCODING_ARRAYS that passes the header checks and carries a script for the
// scripted worker.
std::string ScriptInput(const std::string& script);

// A request that runs `script`.
amhex::v1::SubmitJobRequest ScriptRequest(const std::string& script);

// The unit cube as triangles, in INPUT_ENCODING_ARRAYS.
std::string CubeInput();

// A Draco file header with the given parts; what follows is up to the caller.
std::string DracoFileHeader(int major, int minor, int type, int method, int flags = 0);
// Unsigned LEB128, as Draco writes counts.
std::string Varint(uint64_t value);
std::string LittleEndian(uint64_t value, int byte_count);

// True as soon as `condition` holds, false if it does not within `patience`.
bool Eventually(const std::function<bool()>& condition,
                absl::Duration patience = absl::Seconds(60));

}  // namespace amhex::server
