// What the service costs, on this machine, as one JSON object on standard output:
//
//   control     latency of GetJob at 1,000 calls per second
//   first_frame from SubmitJob's start to the first frame of WatchJob's
//   cycles      jobs from submission to their end, one after the other, per second
//   cancel      from CancelJob's start to the job's end, for a worker that does not listen
//   watcher     CPU time that one watcher costs server and client, in percent of the job's time
//   overhead    what submission, watching and storing a result add to a job of ten seconds
//   tcp, unix, tls  upload and download of blobs this way, beside a bare gRPC stream of the same
//               messages over the same way in the same process ("raw")
//   floors      what an upload cannot do without: hashing, writing, waiting for the disk
//
// Of a transfer the CPU time per GB of the busiest thread is given too: what would bound it if each
// thread had a core of its own. Workers follow scripts, so that nothing but the service is
// measured. Usage: service_benchmark [MEBIBYTES [FOLDER [PART...]]], FOLDER being where the server
// keeps its data, in memory if it is /dev/shm. Without parts, all are measured. Of several rounds
// of a transfer the median is given.
#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "amhex/v1/blob_service.grpc.pb.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "busiest_thread.h"
#include "files.h"
#include "job.h"
#include "logging.h"
#include "server.h"
#include "service/service_fixtures.h"
#include "service/test_certificates.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr size_t kChunkBytes = 1 << 20;
constexpr int kControlCalls = 3000;
constexpr absl::Duration kControlInterval = absl::Milliseconds(1);
constexpr int kJobs = 100;
constexpr int kCancels = 50;
constexpr int kTransferRounds = 5;

[[noreturn]] void Die(const std::string& problem) {
  std::cerr << "service_benchmark: " << problem << "\n";
  std::exit(EXIT_FAILURE);
}

void Check(const grpc::Status& status) {
  if (!status.ok()) Die(status.error_message());
}

// "name":{"p50_ms":..,"p99_ms":..}
std::string Percentiles(const std::string& name, std::vector<absl::Duration> times) {
  std::sort(times.begin(), times.end());
  const auto at = [&times](double share) {
    const auto last = static_cast<double>(times.size() - 1);
    return absl::ToDoubleMilliseconds(times[static_cast<size_t>(share * last)]);
  };
  return absl::StrCat("\"", name, "\":{\"p50_ms\":", at(0.5), ",\"p99_ms\":", at(0.99), "}");
}

struct Stubs {
  std::unique_ptr<amhex::v1::Mesher::Stub> mesher;
  std::unique_ptr<amhex::v1::Blobs::Stub> blobs;
};

Stubs Connect(const std::string& address,
              const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  const auto channel = grpc::CreateChannel(address, credentials);
  return {amhex::v1::Mesher::NewStub(channel), amhex::v1::Blobs::NewStub(channel)};
}

Job Submit(const Stubs& stubs, const std::string& script) {
  grpc::ClientContext context;
  amhex::v1::SubmitJobResponse response;
  Check(stubs.mesher->SubmitJob(&context, ScriptRequest(script), &response));
  return response.job();
}

// Watches until `enough` holds of a frame.
void WatchUntil(const Stubs& stubs, const std::string& name,
                const std::function<bool(const amhex::v1::WatchJobResponse&)>& enough) {
  grpc::ClientContext context;
  amhex::v1::WatchJobRequest request;
  request.set_name(name);
  const auto stream = stubs.mesher->WatchJob(&context, request);
  amhex::v1::WatchJobResponse frame;
  while (stream->Read(&frame) && !enough(frame)) {
  }
  context.TryCancel();
  stream->Finish();
}

bool IsEnd(const amhex::v1::WatchJobResponse& frame) {
  return frame.has_job() && IsFinal(frame.job().state());
}

std::string MeasureControl(const Stubs& stubs) {
  const Job job = Submit(stubs, "succeed mesh;");
  std::vector<absl::Duration> times;
  absl::Time next = absl::Now();
  for (int i = 0; i < kControlCalls; ++i) {
    absl::SleepFor(next - absl::Now());
    // From when the call was due, so that a late one counts in full.
    grpc::ClientContext context;
    amhex::v1::GetJobRequest request;
    request.set_name(job.name());
    Job answer;
    Check(stubs.mesher->GetJob(&context, request, &answer));
    times.push_back(absl::Now() - next);
    next += kControlInterval;
  }
  return Percentiles("control", std::move(times));
}

std::string MeasureFirstFrame(const Stubs& stubs) {
  std::vector<absl::Duration> times;
  for (int i = 0; i < kJobs; ++i) {
    const absl::Time start = absl::Now();
    const Job job = Submit(stubs, absl::StrCat("progress 1; succeed ", i, ";"));
    WatchUntil(stubs, job.name(), [](const auto&) { return true; });
    times.push_back(absl::Now() - start);
    WatchUntil(stubs, job.name(), IsEnd);
  }
  return Percentiles("first_frame", std::move(times));
}

std::string MeasureCycles(const Stubs& stubs) {
  const absl::Time start = absl::Now();
  for (int i = 0; i < kJobs; ++i) {
    WatchUntil(stubs, Submit(stubs, absl::StrCat("succeed cycle", i, ";")).name(), IsEnd);
  }
  return absl::StrCat("\"cycles_per_second\":", kJobs / absl::ToDoubleSeconds(absl::Now() - start));
}

std::string MeasureCancel(const Stubs& stubs) {
  std::vector<absl::Duration> times;
  for (int i = 0; i < kCancels; ++i) {
    const Job job = Submit(stubs, absl::StrCat("progress 1; deaf 60000; succeed ", i, ";"));
    // The first frame, a snapshot, may have it already.
    WatchUntil(stubs, job.name(), [](const auto& frame) {
      return frame.has_progress() || frame.job().has_progress();
    });
    const absl::Time start = absl::Now();
    grpc::ClientContext context;
    amhex::v1::CancelJobRequest request;
    request.set_name(job.name());
    Job answer;
    Check(stubs.mesher->CancelJob(&context, request, &answer));
    WatchUntil(stubs, job.name(), IsEnd);
    times.push_back(absl::Now() - start);
  }
  return Percentiles("cancel", std::move(times));
}

// CPU seconds of this process, all threads, so far.
double CpuSeconds() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return absl::ToDoubleSeconds(absl::DurationFromTimeval(usage.ru_utime) +
                               absl::DurationFromTimeval(usage.ru_stime));
}

// What the server adds to a job of ten seconds with a result of 20 MB, as a share of it.
std::string MeasureOverhead(const Stubs& stubs) {
  constexpr double kSeconds = 10;
  const absl::Time start = absl::Now();
  const Job job = Submit(stubs, "progress 1; sleep 10000; large 20000000;");
  WatchUntil(stubs, job.name(), IsEnd);
  const double seconds = absl::ToDoubleSeconds(absl::Now() - start);
  return absl::StrCat("\"overhead_percent\":", 100 * (seconds / kSeconds - 1));
}

// CPU time of server and client together for one watcher of a job that reports twenty times a
// second, in percent of the job's time.
std::string MeasureWatching(const Stubs& stubs) {
  constexpr int kFrames = 100;
  constexpr int kWatchers = 20;
  std::string script;
  for (int i = 0; i < kFrames; ++i) absl::StrAppend(&script, "progress ", i, "; sleep 50;");
  const auto percent_with = [&](int watcher_count) {
    const Job job = Submit(stubs, absl::StrCat(script, "succeed ", watcher_count, ";"));
    const absl::Time start = absl::Now();
    const double cpu = CpuSeconds();
    std::vector<std::thread> watchers;
    watchers.reserve(watcher_count);
    for (int i = 0; i < watcher_count; ++i) {
      watchers.emplace_back([&] { WatchUntil(stubs, job.name(), IsEnd); });
    }
    for (std::thread& watcher : watchers) watcher.join();
    return 100 * (CpuSeconds() - cpu) / absl::ToDoubleSeconds(absl::Now() - start);
  };
  const double one = percent_with(1);
  const double many = percent_with(kWatchers);
  return absl::StrCat("\"watcher_percent\":", (many - one) / (kWatchers - 1));
}

// What moving some bytes has cost. CPU time is that of both ends, and of the busiest of all their
// threads; other load on the machine lengthens the wall clock's time, hardly the CPU's.
struct Cost {
  double gigabytes_per_second = 0;
  double cpu_seconds_per_gigabyte = 0;
  double busiest_seconds_per_gigabyte = 0;
};

class Stopwatch {
 public:
  Cost After(size_t bytes) {
    const double gigabytes = 1e-9 * static_cast<double>(bytes);
    const double rate = gigabytes / absl::ToDoubleSeconds(absl::Now() - start_);
    const double all = (CpuSeconds() - cpu_) / gigabytes;
    return {rate, all, busiest_.Stop() / gigabytes};
  }

 private:
  BusiestThread busiest_;
  const absl::Time start_ = absl::Now();
  const double cpu_ = CpuSeconds();
};

std::string ToJson(const std::string& name, const Cost& cost) {
  return absl::StrCat("\"", name, "\":{\"gb_per_s\":", cost.gigabytes_per_second,
                      ",\"cpu_s_per_gb\":", cost.cpu_seconds_per_gigabyte,
                      ",\"busiest_thread_s_per_gb\":", cost.busiest_seconds_per_gigabyte, "}");
}

Cost Upload(amhex::v1::Blobs::Stub* blobs, const std::string& bytes, const std::string& sha256) {
  Stopwatch watch;
  grpc::ClientContext context;
  amhex::v1::WriteBlobResponse response;
  const auto stream = blobs->WriteBlob(&context, &response);
  amhex::v1::WriteBlobRequest chunk;
  chunk.mutable_blob()->set_sha256(sha256);
  chunk.mutable_blob()->set_size_bytes(static_cast<int64_t>(bytes.size()));
  for (size_t offset = 0; offset < bytes.size(); offset += kChunkBytes) {
    chunk.set_offset(static_cast<int64_t>(offset));
    chunk.set_data(bytes.data() + offset, std::min(kChunkBytes, bytes.size() - offset));
    chunk.set_finish(offset + kChunkBytes >= bytes.size());
    stream->Write(chunk);
  }
  stream->WritesDone();
  Check(stream->Finish());
  return watch.After(bytes.size());
}

Cost Download(amhex::v1::Blobs::Stub* blobs, const std::string& sha256) {
  Stopwatch watch;
  grpc::ClientContext context;
  amhex::v1::ReadBlobRequest request;
  request.mutable_blob()->set_sha256(sha256);
  const auto stream = blobs->ReadBlob(&context, request);
  size_t total = 0;
  for (amhex::v1::ReadBlobResponse chunk; stream->Read(&chunk);) total += chunk.data().size();
  Check(stream->Finish());
  return watch.After(total);
}

// Takes and gives the same messages, keeps nothing.
class RawBlobs final : public amhex::v1::Blobs::Service {
 public:
  explicit RawBlobs(const std::string& bytes) : bytes_(bytes) {}

  grpc::Status WriteBlob(grpc::ServerContext*, grpc::ServerReader<amhex::v1::WriteBlobRequest>* in,
                         amhex::v1::WriteBlobResponse*) override {
    for (amhex::v1::WriteBlobRequest chunk; in->Read(&chunk);) {
    }
    return grpc::Status::OK;
  }

  grpc::Status ReadBlob(grpc::ServerContext*, const amhex::v1::ReadBlobRequest*,
                        grpc::ServerWriter<amhex::v1::ReadBlobResponse>* out) override {
    amhex::v1::ReadBlobResponse chunk;
    for (size_t offset = 0; offset < bytes_.size(); offset += kChunkBytes) {
      chunk.set_offset(static_cast<int64_t>(offset));
      chunk.set_data(bytes_.data() + offset, std::min(kChunkBytes, bytes_.size() - offset));
      if (!out->Write(chunk)) break;
    }
    return grpc::Status::OK;
  }

 private:
  const std::string& bytes_;
};

// One way between client and server.
struct Way {
  std::string name;
  std::string data;         // the service's folder
  std::string address;      // of the service
  std::string raw_address;  // to listen on; ends with ":0" where a port is to be found
  std::shared_ptr<grpc::ServerCredentials> server;
  std::shared_ptr<grpc::ChannelCredentials> client;
};

Cost Median(std::vector<Cost> costs) {
  const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(costs.size() / 2);
  std::nth_element(costs.begin(), middle, costs.end(), [](const Cost& a, const Cost& b) {
    return a.gigabytes_per_second < b.gigabytes_per_second;
  });
  return *middle;
}

// Writes a file as large as the blob and removes it, so that the blob's own file gets pages that
// the kernel has at hand. A virtual machine gives free ones back to its host, if by the megabyte
// and after some seconds, and getting them again costs several times what the whole upload does.
void FetchPages(const std::string& folder, const std::string& bytes) {
  const std::string path = folder + "/pages";
  const auto file = OpenFile(path, O_WRONLY | O_CREAT);
  if (!file.ok() || !WriteAllAt(file->get(), bytes.data(), bytes.size(), 0).ok()) {
    Die("no file can be written");
  }
  unlink(path.c_str());
}

// Both servers in turn, in each round.
std::string MeasureRounds(const Way& way, std::string bytes, const Stubs& stubs,
                          const Stubs& bare) {
  std::vector<Cost> up, down, raw_up, raw_down;
  for (int round = 0; round < kTransferRounds; ++round) {
    // A blob that is there already would not be received.
    const std::string name = absl::StrCat(way.name, round);
    bytes.replace(0, name.size(), name);
    const std::string sha256 = Sha256Hex(bytes);
    raw_up.push_back(Upload(bare.blobs.get(), bytes, sha256));
    FetchPages(way.data, bytes);
    up.push_back(Upload(stubs.blobs.get(), bytes, sha256));
    raw_down.push_back(Download(bare.blobs.get(), sha256));
    down.push_back(Download(stubs.blobs.get(), sha256));
    // Its pages are for the next round.
    std::filesystem::remove(way.data + "/blobs/" + sha256.substr(0, 2) + "/" + sha256);
  }
  return absl::StrCat("\"", way.name, "\":{", ToJson("upload", Median(up)), ",",
                      ToJson("raw_upload", Median(raw_up)), ",", ToJson("download", Median(down)),
                      ",", ToJson("raw_download", Median(raw_down)), "}");
}

std::string MeasureTransfer(const Way& way, const std::string& bytes) {
  RawBlobs raw(bytes);
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(way.raw_address, way.server, &port);
  builder.RegisterService(&raw);
  const auto raw_server = builder.BuildAndStart();
  const bool is_unix = way.raw_address.rfind("unix:", 0) == 0;
  const Stubs bare =
      Connect(is_unix ? way.raw_address : absl::StrCat("127.0.0.1:", port), way.client);
  const Stubs stubs = Connect(way.address, way.client);
  Upload(bare.blobs.get(), bytes, Sha256Hex(bytes));  // warms up
  std::string measured = MeasureRounds(way, bytes, stubs, bare);
  raw_server->Shutdown();
  return measured;
}

// What an upload cannot do without: hashing the bytes, writing them to a file, and waiting until
// they are on the disk.
std::string MeasureFloors(const std::string& folder, const std::string& bytes) {
  Stopwatch hashing;
  Sha256Hex(bytes);
  const Cost hash = hashing.After(bytes.size());
  FetchPages(folder, bytes);
  const auto file = OpenFile(folder + "/floor", O_WRONLY | O_CREAT);
  if (!file.ok()) Die("no file can be made");
  Stopwatch writing;
  const absl::Status written = WriteAllAt(file->get(), bytes.data(), bytes.size(), 0);
  const Cost write = writing.After(bytes.size());
  if (!written.ok() || !SyncFile(file->get()).ok()) Die("no file can be written");
  const Cost durable = writing.After(bytes.size());
  unlink((folder + "/floor").c_str());
  return absl::StrCat("\"floors\":{", ToJson("hash", hash), ",", ToJson("write", write), ",",
                      ToJson("write_and_sync", durable), "}");
}

std::unique_ptr<Server> StartServer(const ServerOptions& options) {
  auto server = Server::Create(options);
  if (!server.ok()) Die("a server did not start");
  return *std::move(server);
}

int Main(size_t blob_bytes, const std::string& parent, const std::set<std::string>& wanted) {
  if (!parent.empty()) setenv("TMPDIR", parent.c_str(), 1);
  SetUpLogging("error", "text").IgnoreError();
  TemporaryFolder folder;
  TestAuthority authority;
  const PemPair pair = authority.Sign("localhost");
  WriteFileAtomically(folder / "cert", pair.certificate).IgnoreError();
  WriteFileAtomically(folder / "key", pair.key).IgnoreError();
  ServerOptions options;
  options.listen = {"127.0.0.1:0", "unix:" + (folder / "socket")};
  options.metrics_listen = "";
  options.data_dir = folder / "data";
  options.worker = AMHEX_SCRIPTED_WORKER;
  options.limits.max_blob_bytes = 4 * static_cast<int64_t>(blob_bytes);
  const auto plain = StartServer(options);
  options.listen = {"127.0.0.1:0"};
  options.data_dir = folder / "tls-data";
  options.tls.certificate = folder / "cert";
  options.tls.key = folder / "key";
  const auto secure = StartServer(options);

  const auto open_server = grpc::InsecureServerCredentials();
  const auto open_client = grpc::InsecureChannelCredentials();
  grpc::SslServerCredentialsOptions tls;
  tls.pem_key_cert_pairs.push_back({pair.key, pair.certificate});
  const Way ways[] = {
      {"tcp", folder / "data", plain->addresses()[0], "127.0.0.1:0", open_server, open_client},
      {"unix", folder / "data", plain->addresses()[1], "unix:" + (folder / "raw"), open_server,
       open_client},
      {"tls", folder / "tls-data", secure->addresses()[0], "127.0.0.1:0",
       grpc::SslServerCredentials(tls), grpc::SslCredentials({authority.certificate(), "", ""})}};
  const Stubs stubs = Connect(plain->addresses()[0], open_client);
  const std::string bytes(blob_bytes, 'x');
  const std::pair<std::string, std::function<std::string()>> parts[] = {
      {"control", [&] { return MeasureControl(stubs); }},
      {"first_frame", [&] { return MeasureFirstFrame(stubs); }},
      {"cycles", [&] { return MeasureCycles(stubs); }},
      {"cancel", [&] { return MeasureCancel(stubs); }},
      {"watcher", [&] { return MeasureWatching(stubs); }},
      {"overhead", [&] { return MeasureOverhead(stubs); }},
      {"floors", [&] { return MeasureFloors(folder.path(), bytes); }},
      {"tcp", [&] { return MeasureTransfer(ways[0], bytes); }},
      {"unix", [&] { return MeasureTransfer(ways[1], bytes); }},
      {"tls", [&] { return MeasureTransfer(ways[2], bytes); }}};
  std::vector<std::string> measured;
  for (const auto& [name, measure] : parts) {
    if (wanted.empty() || wanted.count(name) > 0) measured.push_back(measure());
  }
  std::cout << "{" << absl::StrJoin(measured, ",") << "}\n";
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace amhex::server

int main(int argc, char** argv) {
  constexpr size_t kDefaultMebibytes = 256;
  const size_t mebibytes = argc > 1 ? std::stoul(argv[1]) : kDefaultMebibytes;
  return amhex::server::Main(mebibytes << 20, argc > 2 ? argv[2] : "",
                             {argv + std::min(argc, 3), argv + argc});
}
