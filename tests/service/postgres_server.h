// A real PostgreSQL 15 that a test starts, stops, pauses and starts again.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

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
  const std::string& host() const { return host_; }
  int port() const { return port_; }
  // Runs pg_dump, psql or another of its programs on a database; false if it fails.
  bool RunProgram(const std::string& program, const std::string& url,
                  const std::vector<std::string>& arguments);

 private:
  bool Answers() const;

  TemporaryFolder folder_;
  const std::string host_;
  const int port_;
  pid_t pid_ = 0;
  int database_count_ = 0;
};

// The test process's own, started when first asked for.
PostgresServer& SharedPostgres();

}  // namespace amhex::server
