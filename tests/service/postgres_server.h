// A real PostgreSQL 15 that a test starts, stops, pauses and starts again.
#pragma once

#include <sys/types.h>

#include <string>

#include "service_fixtures.h"

namespace amhex::server {

// Every test process has one at most; it and its files go with the object.
class PostgresServer {
 public:
  PostgresServer();
  ~PostgresServer();

  void Start();
  // As in a crash: nothing is written any more.
  void Kill();
  void Pause();
  void Resume();

  // A fresh, empty database, as postgres://...
  std::string MakeDatabase();
  int port() const { return port_; }

 private:
  bool Answers() const;

  TemporaryFolder folder_;
  int port_ = 0;
  pid_t pid_ = 0;
  int database_count_ = 0;
};

// The test process's own, started when first asked for.
PostgresServer& SharedPostgres();

}  // namespace amhex::server
