#include "server.h"

#include <grpc/grpc.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <malloc.h>
#include <prometheus/exposer.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>

#include "amhex/mesher.h"
#include "authenticator.h"
#include "blob_service.h"
#include "convert.h"
#include "grpc_job_relay.h"
#include "job_manager.h"
#include "latest_shown.h"
#include "logging.h"
#include "meshing_service.h"
#include "status_macros.h"
#include "store_choice.h"
#include "version.h"
#include "worker_pool.h"

namespace amhex::server {
namespace {

namespace fs = std::filesystem;

constexpr int kBlockingThreads = 8;
// What is left of calls after the workers have stopped may finish within this.
constexpr absl::Duration kCallGrace = absl::Seconds(1);
// However short leases are: a worker speaks once a second, if the machine lets it.
constexpr absl::Duration kLeastSilencePatience = absl::Seconds(5);
constexpr char kMesherService[] = "amhex.v1.Mesher";
constexpr char kBlobsService[] = "amhex.v1.Blobs";
constexpr char kWorkerService[] = "worker";
constexpr int kMaxStreamsPerConnection = 1024;
constexpr int kMaxMetadataBytes = 16 * 1024;
// Half of what the client library and other nodes do.
constexpr int kMinPingIntervalMilliseconds = 5'000;
// Callers that vanish without a word are noticed, and what they watched is let go.
constexpr int kPingMilliseconds = 30'000;
constexpr int kPingPatienceMilliseconds = 20'000;

// Of memory that is free again, each of the allocator's arenas keeps what a few streams' chunks
// take. By default it gives all of it back to the kernel at once and gets it again for the next
// chunk, zeroed page by page: a quarter of what moving a blob costs.
constexpr int kKeptBytes = 16 << 20;
// What is larger than the largest message comes from the kernel on its own.
constexpr int kOwnMappingBytes = 4 << 20;

// Of the allocator's arenas by default there are eight per core. Chunks wander from thread to
// thread, so that each arena comes to hold pages of its own that were zeroed for it. As many as
// cores keep threads from waiting for each other.
constexpr unsigned kLeastArenas = 2;

// How the bytes of a blob come in. From a socket gRPC takes 8 KiB at first by default, in frames of
// 16 KiB; how much of a stream may be under way before its reader asks for it is a message of the
// largest size. Measured in docs/performance.md, "Throughput"; the least that is read at a time
// stays gRPC's, as each idle connection holds that much.
constexpr int kSocketReadBytes = 256 << 10;
constexpr int kFrameBytes = 1 << 20;
constexpr int kStreamWindowBytes = 4 << 20;

// mallopt is not for several threads at once; only the one that starts the server calls it.
void KeepMemoryOfChunks() {
  const auto arenas = static_cast<int>(std::max(kLeastArenas, std::thread::hardware_concurrency()));
  mallopt(M_ARENA_MAX, arenas);                 // NOLINT(concurrency-mt-unsafe)
  mallopt(M_TRIM_THRESHOLD, kKeptBytes);        // NOLINT(concurrency-mt-unsafe)
  mallopt(M_MMAP_THRESHOLD, kOwnMappingBytes);  // NOLINT(concurrency-mt-unsafe)
}

// Keeps gRPC initialized until the process ends. When its last user goes, gRPC waits for its own
// poller of writes, which sleeps for ten seconds if a caller had stopped reading; nothing is gained
// by that wait.
void KeepGrpc() {
  static const bool kKept = (grpc_init(), true);
  static_cast<void>(kKept);
}

// Removes a folder at the end.
struct TemporaryFolder {
  std::string path;
  ~TemporaryFolder() {
    std::error_code error;
    if (!path.empty()) fs::remove_all(path, error);
  }
};

absl::StatusOr<std::string> MakeTemporaryFolder() {
  std::error_code error;
  std::string path = (fs::temp_directory_path(error) / "amhexd-XXXXXX").string();
  if (mkdtemp(path.data()) == nullptr) return FileError("cannot make a temporary folder", errno);
  return path;
}

Authenticator::Mode AuthenticationMode(const ServerOptions& options) {
  if (!options.tokens.empty()) return Authenticator::Mode::kTokens;
  if (!options.tls.client_ca.empty()) return Authenticator::Mode::kCertificates;
  return Authenticator::Mode::kNobodyAsked;
}

absl::StatusOr<GrpcJobRelay::Options> PeerOptions(const ServerOptions& options) {
  // Read now only to find out about a file that is missing.
  if (!options.peer_token.empty()) {
    AMHEX_RETURN_IF_ERROR(ReadWholeFile(options.peer_token).status());
  }
  return GrpcJobRelay::Options{MakePeerCredentials(options.peer_ca, options.tls),
                               options.peer_token};
}

// A message that is not whole yet waits in memory, also one of a caller who has not said who he is,
// and neither the number of connections nor that of their calls bounds that. Beyond this gRPC takes
// less at a time, and ends calls with RESOURCE_EXHAUSTED.
void BoundMessageMemory(int64_t bytes, grpc::ServerBuilder* builder) {
  grpc::ResourceQuota quota("messages");
  quota.Resize(static_cast<size_t>(bytes));
  builder->SetResourceQuota(quota);
}

void SetTransferArguments(grpc::ServerBuilder* builder) {
  builder->AddChannelArgument(GRPC_ARG_TCP_READ_CHUNK_SIZE, kSocketReadBytes);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MAX_FRAME_SIZE, kFrameBytes);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, kStreamWindowBytes);
}

void SetConnectionArguments(const Limits& limits, grpc::ServerBuilder* builder) {
  builder->AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreamsPerConnection);
  builder->AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, kMaxMetadataBytes);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                              kMinPingIntervalMilliseconds);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kPingMilliseconds);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingPatienceMilliseconds);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  if (limits.max_connection_age <= absl::ZeroDuration()) return;
  // Without a time of grace calls under way are never cut.
  const int64_t age = std::min<int64_t>(absl::ToInt64Milliseconds(limits.max_connection_age),
                                        std::numeric_limits<int>::max());
  builder->AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, static_cast<int>(age));
}

std::string WithPort(const std::string& address, int port) {
  const size_t colon = address.rfind(':');
  if (address.compare(0, 4, "unix") == 0 || colon == std::string::npos) return address;
  return address.substr(0, colon + 1) + std::to_string(port);
}

}  // namespace

// Which services are SERVING.
struct Health {
  bool mesher = false;
  bool worker = false;
  bool blobs = false;
};

struct Server::Parts {
  ServerOptions options;
  TemporaryFolder temporary;
  UniqueFd lock;
  std::unique_ptr<Metrics> metrics;
  std::unique_ptr<JobManager> manager;
  std::unique_ptr<WorkerPool> pool;
  std::unique_ptr<Authenticator> authenticator;
  std::unique_ptr<BlockingExecutor> executor;
  std::unique_ptr<MeshingService> meshing_service;
  std::unique_ptr<BlobService> blob_service;
  std::unique_ptr<grpc::Server> grpc_server;
  std::unique_ptr<prometheus::Exposer> exposer;
  std::vector<std::string> addresses;
  std::string metrics_address;
  LatestShown<Health> health{[this] { return LookAtHealth(); },
                             [this](const Health& state) { ShowHealth(state); }};
  std::mutex stop_mutex;
  std::condition_variable hurry;
  std::atomic<bool> stopping{false};
  bool in_a_hurry = false;
  bool stopped = false;

  absl::Status OpenStores();
  absl::Status StartGrpc();
  absl::Status StartMetrics();
  Health LookAtHealth() const;
  void ShowHealth(const Health& state) const;
  // Waits, unless somebody is in a hurry.
  void WaitForBalancers();
};

absl::Status Server::Parts::OpenStores() {
  AMHEX_ASSIGN_OR_RETURN(authenticator,
                         Authenticator::Create(AuthenticationMode(options), options.tokens));
  std::string folder = options.data_dir;
  if (options.ephemeral) {
    AMHEX_ASSIGN_OR_RETURN(temporary.path, MakeTemporaryFolder());
    folder = temporary.path;
  }
  AMHEX_RETURN_IF_ERROR(MakeFolders(folder));
  AMHEX_ASSIGN_OR_RETURN(StorePlaces places, OpenStore(options, folder));
  lock = std::move(places.lock);
  AMHEX_ASSIGN_OR_RETURN(auto blobs,
                         BlobStore::Open(folder, options.limits, places.private_folder));
  metrics = std::make_unique<Metrics>(kServerVersion);
  JobManager::Options manager_options;
  manager_options.limits = options.limits;
  if (options.share_results) manager_options.engine_build = EngineVersion();
  manager_options.lease = options.lease;
  manager_options.predict_cost = [](const amhex::v1::MeshingParams& params, int64_t elements) {
    const CostEstimate cost = PredictCost(ToEngine(params), elements);
    return ExpectedCost{cost.memory_bytes, absl::Seconds(cost.seconds)};
  };
  manager_options.unknown_memory_bytes =
      options.limits.max_running_memory_bytes / std::max(options.worker_count, 1);
  if (IsCluster(options)) {
    manager_options.node = options.node_name;
    manager_options.address = AdvertisedAddress(options);
    AMHEX_ASSIGN_OR_RETURN(const auto relay_options, PeerOptions(options));
    manager_options.relay = std::make_shared<GrpcJobRelay>(relay_options);
  }
  AMHEX_ASSIGN_OR_RETURN(manager, JobManager::Create(manager_options, std::move(places.store),
                                                     std::move(blobs), metrics.get()));
  WorkerPool::Options pool_options;
  pool_options.command.path = options.worker;
  pool_options.command.memory_limit_bytes = options.limits.max_worker_memory_bytes;
  pool_options.cuda_devices = options.cuda_devices;
  pool_options.worker_count = options.worker_count;
  pool_options.silence_patience = std::max(options.lease, kLeastSilencePatience);
  pool = std::make_unique<WorkerPool>(pool_options, manager.get());
  return absl::OkStatus();
}

absl::Status Server::Parts::StartGrpc() {
  executor = std::make_unique<BlockingExecutor>(kBlockingThreads);
  meshing_service = std::make_unique<MeshingService>(
      MeshingService::Parts{manager.get(), pool.get(), authenticator.get(), executor.get()});
  blob_service = std::make_unique<BlobService>(manager.get(), authenticator.get(), executor.get());
  KeepGrpc();
  KeepMemoryOfChunks();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  const auto tls = MakeServerCredentials(options.tls);
  std::vector<int> ports(options.listen.size(), 0);
  for (size_t i = 0; i < options.listen.size(); ++i) {
    // Whoever can open a unix socket is known to the file system; TLS would add nothing.
    const bool plain = IsUnixAddress(options.listen[i]) && options.tls.client_ca.empty();
    builder.AddListeningPort(options.listen[i], plain ? grpc::InsecureServerCredentials() : tls,
                             &ports[i]);
  }
  const auto max_message = static_cast<int>(options.limits.max_message_bytes);
  builder.SetMaxReceiveMessageSize(max_message);
  builder.SetMaxSendMessageSize(max_message);
  SetConnectionArguments(options.limits, &builder);
  SetTransferArguments(&builder);
  BoundMessageMemory(options.message_memory_bytes, &builder);
  builder.RegisterService(meshing_service.get());
  builder.RegisterService(blob_service.get());
  grpc_server = builder.BuildAndStart();
  for (size_t i = 0; i < ports.size(); ++i) {
    if (!grpc_server || ports[i] == 0) {
      return absl::UnavailableError("cannot serve on " + options.listen[i]);
    }
    addresses.push_back(WithPort(options.listen[i], ports[i]));
  }
  health.Refresh();
  return absl::OkStatus();
}

absl::Status Server::Parts::StartMetrics() {
  if (options.metrics_listen.empty()) return absl::OkStatus();
  try {
    exposer = std::make_unique<prometheus::Exposer>(options.metrics_listen);
  } catch (const std::exception&) {
    return absl::UnavailableError("cannot serve metrics on " + options.metrics_listen);
  }
  exposer->RegisterCollectable(metrics->registry());
  metrics_address = WithPort(options.metrics_listen, exposer->GetListeningPorts().front());
  return absl::OkStatus();
}

Health Server::Parts::LookAtHealth() const {
  const bool has_worker = pool->ready_count() > 0;
  return {has_worker && !stopping, has_worker, !stopping};
}

// "" tells that the process lives, also while it drains; the others whether they are of use.
void Server::Parts::ShowHealth(const Health& state) const {
  auto* service = grpc_server->GetHealthCheckService();
  service->SetServingStatus(kMesherService, state.mesher);
  service->SetServingStatus(kWorkerService, state.worker);
  service->SetServingStatus(kBlobsService, state.blobs);
}

void Server::Parts::WaitForBalancers() {
  std::unique_lock<std::mutex> waiting(stop_mutex);
  hurry.wait_for(waiting, absl::ToChronoMilliseconds(options.drain_delay),
                 [this] { return in_a_hurry; });
}

Server::Server(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

absl::StatusOr<std::unique_ptr<Server>> Server::Create(const ServerOptions& options) {
  AMHEX_RETURN_IF_ERROR(Validate(options));
  auto parts = std::make_unique<Parts>();
  parts->options = options;
  std::unique_ptr<Server> server(new Server(std::move(parts)));
  AMHEX_RETURN_IF_ERROR(server->parts_->OpenStores());
  AMHEX_RETURN_IF_ERROR(server->parts_->StartMetrics());
  AMHEX_RETURN_IF_ERROR(server->parts_->StartGrpc());
  server->parts_->pool->Start([raw = server->parts_.get()] { raw->health.Refresh(); });
  for (const std::string& address : server->addresses()) {
    LogInfo("serving", {{"address", address}, {"version", kServerVersion}});
  }
  return server;
}

absl::Status Server::Check(const ServerOptions& options) {
  AMHEX_RETURN_IF_ERROR(Validate(options));
  return Authenticator::Create(AuthenticationMode(options), options.tokens).status();
}

Server::~Server() {
  if (parts_->grpc_server && !parts_->stopped) Stop(absl::Now());
}

const std::vector<std::string>& Server::addresses() const { return parts_->addresses; }
const std::string& Server::metrics_address() const { return parts_->metrics_address; }
JobManager& Server::manager() { return *parts_->manager; }
WorkerPool& Server::pool() { return *parts_->pool; }

void Server::Stop(absl::Time deadline) {
  if (parts_->stopping.exchange(true)) {
    {
      std::lock_guard<std::mutex> lock(parts_->stop_mutex);
      parts_->in_a_hurry = true;
    }
    parts_->hurry.notify_all();
    parts_->pool->HurryUp(deadline);
    return;
  }
  LogInfo("draining", {{"seconds", absl::ToDoubleSeconds(deadline - absl::Now())}});
  parts_->health.Refresh();
  if (deadline > absl::Now()) parts_->WaitForBalancers();
  parts_->manager->StartDraining();
  parts_->pool->Stop(deadline);
  parts_->manager->CloseFeeds();
  parts_->grpc_server->Shutdown(absl::ToChronoTime(absl::Now() + kCallGrace));
  parts_->grpc_server->Wait();
  parts_->exposer.reset();
  parts_->executor.reset();
  parts_->stopped = true;
  LogInfo("stopped", {});
}

}  // namespace amhex::server
