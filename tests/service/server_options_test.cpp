// The command line: which addresses are open, that every limit can be set, what is shown of it.
#include "server_options.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace amhex::server {
namespace {

absl::StatusOr<ServerOptions> Parse(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"amhexd", "--worker", AMHEX_SCRIPTED_WORKER});
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  int exit_code = 0;
  return ParseOptions(static_cast<int>(pointers.size()), pointers.data(), &exit_code);
}

// One field's value, as bytes.
std::string Only(amhex::v1::Limits limits, const google::protobuf::FieldDescriptor* field) {
  const auto* access = limits.GetReflection();
  std::vector<const google::protobuf::FieldDescriptor*> set;
  access->ListFields(limits, &set);
  for (const auto* other : set) {
    if (other != field) access->ClearField(&limits, other);
  }
  return limits.SerializeAsString();
}

TEST(ServerOptionsCheck, PlaintextBeyondTheMachineNeedsInsecure) {
  ServerOptions options;
  options.worker = AMHEX_SCRIPTED_WORKER;
  options.listen = {"0.0.0.0:50051"};
  EXPECT_FALSE(Validate(options).ok());
  options.insecure = true;
  EXPECT_TRUE(Validate(options).ok());
  for (const char* local : {"127.0.0.1:1", "localhost:1", "[::1]:1", "unix:/tmp/x"}) {
    EXPECT_TRUE(IsLocalAddress(local)) << local;
  }
  for (const char* open : {"0.0.0.0:1", "[::]:1", "example.org:1", "127evil.org:1",
                           "127.0.0.1.example.org:1", "localhost.example.org:1"}) {
    EXPECT_FALSE(IsLocalAddress(open)) << open;
  }
}

TEST(ServerOptionsCheck, TheMetricsPageBeyondTheMachineMustBeAskedFor) {
  for (const char* open : {"0.0.0.0:9464", "9464", "[::]:9464", "127.0.0.1:9464,0.0.0.0:9465"}) {
    const std::string page = std::string("--metrics-listen=") + open;
    EXPECT_FALSE(Parse({page}).ok()) << open;
    EXPECT_TRUE(Parse({page, "--metrics-insecure"}).ok()) << open;
    EXPECT_TRUE(Parse({page, "--insecure"}).ok()) << open;
    EXPECT_FALSE(Parse({"--metrics-insecure", "--listen=0.0.0.0:1"}).ok());
  }
  EXPECT_TRUE(Parse({"--metrics-listen=127.0.0.1:0"}).ok());
  EXPECT_TRUE(Parse({"--metrics-listen", ""}).ok());
}

TEST(ServerOptionsCheck, EveryDeviceNeedsAWorker) {
  EXPECT_TRUE(Parse({"--cuda-devices=0,1", "--workers=2"}).ok());
  EXPECT_TRUE(Parse({"--cuda-devices=0,1", "--workers=5"}).ok());
  EXPECT_FALSE(Parse({"--cuda-devices=0,1", "--workers=1"}).ok());
}

TEST(ServerOptionsCheck, EveryLimitThatIsToldCanBeSet) {
  const auto options = Parse({"--max-blob-bytes=7",        "--max-blob-store-bytes=7",
                              "--max-queued-jobs=7",       "--max-points=7",
                              "--max-triangles=7",         "--max-attributes=7",
                              "--max-attempts=7",          "--max-labels=7",
                              "--max-label-bytes=7",       "--max-watchers=7",
                              "--max-tenant-watchers=7",   "--min-free-disk-bytes=7",
                              "--quarantine-seconds=7",    "--max-connection-seconds=7",
                              "--max-uploads=7",           "--max-page-size=7",
                              "--max-run-seconds=7",       "--retention-seconds=7",
                              "--max-retention-seconds=8", "--worker-memory-bytes=7",
                              "--running-memory-bytes=7"});
  ASSERT_TRUE(options.ok()) << options.status();
  // Part of the contract: what a message may hold does not differ from server to server.
  const std::set<std::string> fixed = {"max_inline_input_bytes", "max_message_bytes",
                                       "preferred_chunk_bytes"};
  const amhex::v1::Limits set = ToProto(options->limits), usual = ToProto(Limits());
  const auto* descriptor = amhex::v1::Limits::descriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* field = descriptor->field(i);
    EXPECT_EQ(Only(set, field) == Only(usual, field), fixed.count(field->name()) == 1)
        << field->name();
  }
}

TEST(ServerOptionsCheck, LimitsOfNothingAreRefused) {
  for (const char* flag :
       {"--max-blob-bytes", "--max-queued-jobs", "--max-points", "--max-triangles",
        "--max-attributes", "--max-attempts", "--max-labels", "--max-label-bytes", "--max-watchers",
        "--max-tenant-watchers", "--max-uploads", "--max-page-size", "--max-run-seconds",
        "--retention-seconds"}) {
    EXPECT_FALSE(Parse({std::string(flag) + "=0"}).ok()) << flag;
    EXPECT_TRUE(Parse({std::string(flag) + "=1"}).ok()) << flag;
  }
}

TEST(ServerOptionsCheck, MessagesNeedRoomForSeveralOfTheLargest) {
  EXPECT_EQ(Parse({})->message_memory_bytes, 512 * kMebibyte);
  EXPECT_FALSE(Parse({"--message-memory-bytes=33554431"}).ok());
  const auto options = Parse({"--message-memory-bytes=33554432"});
  ASSERT_TRUE(options.ok()) << options.status();
  EXPECT_EQ(options->message_memory_bytes, 32 * kMebibyte);
}

TEST(ServerOptionsCheck, NoPasswordOfAStoreIsShown) {
  for (const char* store :
       {"postgres://me:secret@db/jobs", "postgres://:secret@db/jobs",
        "postgres://me:half@secret@db/jobs", "postgres://me@db/jobs?password=secret",
        "postgres://db/jobs?sslmode=require&password=secret&user=me",
        "postgres://db/jobs?sslpassword=secret", "postgresql://me:secret@db/jobs"}) {
    const auto options = Parse({"--node-name=node", std::string("--store=") + store});
    ASSERT_TRUE(options.ok()) << options.status();
    EXPECT_NE(options->effective.find("db/jobs"), std::string::npos) << options->effective;
    EXPECT_EQ(options->effective.find("secret"), std::string::npos) << options->effective;
  }
}

}  // namespace
}  // namespace amhex::server
