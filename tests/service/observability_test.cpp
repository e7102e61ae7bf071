// What operators see: log lines that machines read, and a metrics page that keeps Prometheus'
// rules.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "daemon_fixture.h"
#include "files.h"
#include "google/protobuf/struct.pb.h"
#include "google/protobuf/util/json_util.h"
#include "logging.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using google::protobuf::Struct;

constexpr char kPayload[] = "payload-not-to-be-seen";

class ObservabilityTest : public DaemonTest {};

std::vector<std::string> LinesOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string TextOf(const Struct& line, const std::string& key) {
  const auto found = line.fields().find(key);
  return found == line.fields().end() ? "" : found->second.string_value();
}

TEST_F(ObservabilityTest, JsonLogHasAnObjectPerTransitionAndNoPayload) {
  LogTo(folder() / "log");
  Start({"--log-format", "json", "--log-level", "debug"});
  const pid_t server = pid();
  const std::string good = Submit(std::string("progress 1; stage; succeed ") + kPayload + ";");
  ASSERT_TRUE(Reaches(good, Job::SUCCEEDED));
  const std::string bad = Submit(std::string("progress 1; fail; touch ") + kPayload + ";");
  ASSERT_TRUE(Reaches(bad, Job::FAILED));
  kill(pid(), SIGTERM);
  ASSERT_EQ(Wait(), 0);
  const auto log = ReadWholeFile(folder() / "log");
  ASSERT_TRUE(log.ok());
  EXPECT_EQ(log->find(kPayload), std::string::npos);
  std::map<std::string, std::vector<std::string>> events_of_job;
  for (const std::string& text : LinesOf(*log)) {
    Struct line;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(text, &line).ok()) << text;
    for (const char* key : {"time", "level", "event"}) EXPECT_NE(TextOf(line, key), "") << text;
    EXPECT_EQ(line.fields().at("pid").number_value(), server);
    events_of_job[TextOf(line, "job")].push_back(TextOf(line, "event"));
  }
  EXPECT_EQ(events_of_job[good],
            (std::vector<std::string>{"job_queued", "job_started", "stage_done", "job_finished"}));
  EXPECT_EQ(events_of_job[bad],
            (std::vector<std::string>{"job_queued", "job_started", "job_finished"}));
}

// What LogInfo writes to standard error in a process of its own.
std::string LoggedAsJson(const std::string& value) {
  const TemporaryFolder folder;
  const std::string path = folder / "log";
  const pid_t child = fork();
  if (child == 0) {
    if (freopen(path.c_str(), "w", stderr) == nullptr) _exit(1);
    if (!SetUpLogging("info", "json").ok()) _exit(1);
    LogInfo("strange", {{"value", value},
                        {"count", int64_t{7}},
                        {"ratio", std::numeric_limits<double>::quiet_NaN()}});
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  const auto text = ReadWholeFile(path);
  return text.ok() ? *text : "";
}

TEST(JsonLog, StrangeBytesStayOneValidLine) {
  for (const std::string& value :
       {std::string("quote \" backslash \\ newline \n tab \t"), std::string("nul \0 bell \a", 10),
        std::string("gr\xc3\xbc\xc3\x9f \xf0\x9f\x98\x80")}) {
    const std::string text = LoggedAsJson(value);
    EXPECT_EQ(LinesOf(text).size(), 1u) << text;
    Struct line;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(text, &line).ok()) << text;
    EXPECT_EQ(TextOf(line, "value"), value);
    EXPECT_EQ(line.fields().at("count").number_value(), 7);
    EXPECT_NE(TextOf(line, "ratio"), "");
  }
  // Overlong, a lone continuation, half a surrogate pair, cut off: none is UTF-8.
  for (const char* broken : {"\xc0\xaf", "\x80", "\xed\xa0\x80", "\xe2\x82", "\xff"}) {
    Struct line;
    const std::string text = LoggedAsJson(broken);
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(text, &line).ok()) << text;
    EXPECT_EQ(TextOf(line, "value").find("\xef\xbf\xbd"), 0u);
  }
}

TEST(JsonLog, UnknownFormatIsRefused) {
  EXPECT_TRUE(CheckLogging("info", "json").ok());
  EXPECT_FALSE(CheckLogging("info", "xml").ok());
  EXPECT_FALSE(CheckLogging("loud", "text").ok());
}

// One family of the page.
struct Family {
  std::string type;
  std::string help;
  std::vector<std::string> samples;  // whole lines
};

std::map<std::string, Family> FamiliesOf(const std::string& page) {
  std::map<std::string, Family> families;
  std::string current;
  for (const std::string& line : LinesOf(page)) {
    std::istringstream words(line);
    std::string hash, keyword;
    if (line.rfind("# ", 0) == 0) {
      words >> hash >> keyword >> current;
      std::string rest;
      std::getline(words >> std::ws, rest);
      (keyword == "HELP" ? families[current].help : families[current].type) = rest;
    } else {
      families[current].samples.push_back(line);
    }
  }
  return families;
}

void ExpectGoodName(const std::string& name, const Family& family) {
  static const std::regex kName("(amhex|grpc_server)_[a-z]+(_[a-z]+)*");
  EXPECT_TRUE(std::regex_match(name, kName)) << name;
  EXPECT_FALSE(family.help.empty()) << name;
  const bool is_total = name.size() > 6 && name.substr(name.size() - 6) == "_total";
  EXPECT_EQ(family.type == "counter", is_total) << name;
  // Base units only: seconds and bytes.
  static const std::regex kOtherUnit(
      "_(ms|us|ns|milliseconds|microseconds|minutes|hours|kib|mib|gib|kb|mb|gb|kilobytes|"
      "megabytes|percent)(_|$)");
  EXPECT_FALSE(std::regex_search(name, kOtherUnit)) << name;
}

void ExpectGoodSamples(const std::string& name, const Family& family) {
  static const std::set<std::string> kLabels = {
      "state", "reason",  "type",   "outcome", "dir",        "cause", "result",
      "stage", "version", "method", "status",  "size_class", "le"};
  static const std::regex kLabel("([a-z_]+)=\"([^\"]*)\"");
  static const std::regex kId("[0-9a-f]{8}-[0-9a-f]{4}-|jobs/|[0-9a-f]{32}");
  for (const std::string& sample : family.samples) {
    EXPECT_FALSE(std::regex_search(sample, kId)) << sample;
    for (std::sregex_iterator label(sample.begin(), sample.end(), kLabel), end; label != end;
         ++label) {
      EXPECT_EQ(kLabels.count((*label)[1]), 1u) << sample;
    }
  }
  if (family.type != "histogram") return;
  const auto ends_with_infinity = [](const std::string& sample) {
    return sample.find("le=\"+Inf\"") != std::string::npos;
  };
  EXPECT_TRUE(std::any_of(family.samples.begin(), family.samples.end(), ends_with_infinity))
      << name;
}

// How many observations a histogram has, for one set of labels as they stand on the page.
int CountOf(const std::string& page, const std::string& name, const std::string& labels) {
  const std::string line = "\n" + name + "_count" + labels + " ";
  const size_t found = page.find(line);
  return found == std::string::npos ? 0 : std::atoi(page.c_str() + found + line.size());
}

TEST_F(ObservabilityTest, EveryCallIsCountedByMethodAndStatus) {
  Start();
  const std::string name = Submit("progress 1; succeed mesh;");
  ASSERT_TRUE(Reaches(name, Job::SUCCEEDED));
  for (const std::string& watched : {name, std::string("jobs/1")}) {
    grpc::ClientContext context;
    amhex::v1::WatchJobRequest request;
    request.set_name(watched);
    const auto stream = mesher().WatchJob(&context, request);
    for (amhex::v1::WatchJobResponse frame; stream->Read(&frame);) {
    }
    stream->Finish();
  }
  const auto blobs = amhex::v1::Blobs::NewStub(channel());
  const auto read = [&](const amhex::v1::BlobRef& blob) {
    grpc::ClientContext context;
    amhex::v1::ReadBlobRequest request;
    *request.mutable_blob() = blob;
    const auto stream = blobs->ReadBlob(&context, request);
    for (amhex::v1::ReadBlobResponse chunk; stream->Read(&chunk);) {
    }
    stream->Finish();
  };
  read(Get(name).result().mesh());
  amhex::v1::BlobRef absent;
  absent.set_sha256(std::string(64, 'a'));
  read(absent);
  grpc::ClientContext query_context, find_context, write_context, mesh_context;
  amhex::v1::QueryWriteStatusResponse status;
  blobs->QueryWriteStatus(&query_context, {}, &status);
  amhex::v1::FindMissingBlobsResponse missing;
  blobs->FindMissingBlobs(&find_context, {}, &missing);
  amhex::v1::WriteBlobResponse written;
  const auto writer = blobs->WriteBlob(&write_context, &written);
  writer->WritesDone();
  writer->Finish();
  const auto mesh = mesher().Mesh(&mesh_context);
  mesh->WritesDone();
  mesh->Finish();
  const auto counted = [this](const std::string& method, const std::string& code) {
    return CountOf(MetricsPage(), "grpc_server_call_duration_seconds",
                   "{method=\"amhex.v1." + method + "\",status=\"" + code + "\"}");
  };
  EXPECT_EQ(counted("Mesher/SubmitJob", "OK"), 1);
  EXPECT_GE(counted("Mesher/GetJob", "OK"), 1);
  EXPECT_EQ(counted("Mesher/WatchJob", "OK"), 1);
  EXPECT_EQ(counted("Blobs/ReadBlob", "OK"), 1);
  EXPECT_EQ(counted("Blobs/ReadBlob", "NOT_FOUND"), 1);
  for (const char* method : {"Mesher/WatchJob", "Mesher/Mesh", "Blobs/WriteBlob",
                             "Blobs/QueryWriteStatus", "Blobs/FindMissingBlobs"}) {
    EXPECT_EQ(counted(method, "INVALID_ARGUMENT"), 1) << method;
  }
}

TEST_F(ObservabilityTest, MetricsKeepTheRulesOfPrometheus) {
  Start();
  ASSERT_TRUE(Reaches(Submit("progress 1; stage; succeed mesh;"), Job::SUCCEEDED));
  ASSERT_TRUE(Reaches(Submit("progress 1; fail;"), Job::FAILED));
  ASSERT_TRUE(
      Reaches(Submit("progress 1; once " + (folder() / "a") + "; succeed mesh;"), Job::SUCCEEDED));
  const std::string page = MetricsPage();
  const auto families = FamiliesOf(page);
  EXPECT_GE(families.size(), 20u);
  for (const auto& [name, family] : families) {
    if (name.rfind("exposer_", 0) == 0) continue;  // of the library that serves the page
    ExpectGoodName(name, family);
    ExpectGoodSamples(name, family);
  }
  if (std::system("command -v promtool > /dev/null") != 0) return;
  ASSERT_TRUE(WriteFileAtomically(folder() / "page", page).ok());
  EXPECT_EQ(std::system(("promtool check metrics < " + (folder() / "page")).c_str()), 0);
}

}  // namespace
}  // namespace amhex::server
