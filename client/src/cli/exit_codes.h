// What the exit status of `amhex` tells a script. Part of the interface: numbers never change.
#pragma once

#include "absl/status/status.h"

namespace amhex::client {

enum ExitCode : int {
  kExitSuccess = 0,       // what was asked for is done; for `mesh`: a valid mesh has been written
  kExitFault = 1,         // a fault in amhex or the server
  kExitUsage = 2,         // the command line is wrong
  kExitInput = 3,         // the input or a parameter is bad: missing, damaged, encloses no volume
  kExitNoServer = 4,      // the server cannot be reached or started
  kExitNoMesh = 5,        // the engine found no valid mesh
  kExitLimit = 6,         // time, memory, disk or queue are exhausted
  kExitOutput = 7,        // the output cannot be written
  kExitDamaged = 8,       // what the server sent did not pass the checks
  kExitNoJob = 9,         // no such job, or its result is gone
  kExitUnavailable = 10,  // what was asked for is not available here, e.g. the CUDA backend
  kExitAccess = 11,       // the server does not know the caller, or the caller may not do this
  kExitCancelled = 130,   // interrupted, or cancelled by somebody
};

// The table that `amhex --help` shows.
const char* ExitCodeHelp();

// By the reason where the server gave one, else by the status code.
ExitCode ExitCodeOf(const absl::Status& status);

// Prints "amhex: error: <message> [REASON]" to stderr and gives the exit code.
int Fail(const absl::Status& status);
int Fail(const absl::Status& status, ExitCode code);

}  // namespace amhex::client
