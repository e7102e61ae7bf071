#include "meshing_service.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "call_record.h"
#include "mesh_reactor.h"
#include "request_checks.h"
#include "status_macros.h"
#include "version.h"
#include "watch_reactor.h"

namespace amhex::server {

using amhex::v1::Job;

namespace {

// W3C Trace Context 3.2: version-traceid-parentid-flags, 55 bytes in version 00; no id is all
// zeros, ff is no version. Anything else is not carried.
std::string TraceParentOf(const grpc::CallbackServerContext& context) {
  constexpr std::string_view kLayout = "hh-hhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhh-hhhhhhhhhhhhhhhh-hh";
  constexpr size_t kTraceBegin = 3;
  constexpr size_t kParentBegin = 36;
  const auto header = context.client_metadata().find("traceparent");
  if (header == context.client_metadata().end()) return "";
  const std::string value(header->second.data(), header->second.size());
  if (value.size() != kLayout.size()) return "";
  for (size_t i = 0; i < value.size(); ++i) {
    const bool is_digit = absl::ascii_isdigit(static_cast<unsigned char>(value[i])) ||
                          (value[i] >= 'a' && value[i] <= 'f');
    if (kLayout[i] == '-' ? value[i] != '-' : !is_digit) return "";
  }
  const bool any_trace = value.find_first_not_of('0', kTraceBegin) < kParentBegin - 1;
  const bool any_parent = value.find_first_not_of('0', kParentBegin) < kLayout.size() - 3;
  return any_trace && any_parent && value.compare(0, 2, "ff") != 0 ? value : "";
}

}  // namespace

grpc::ServerUnaryReactor* MeshingService::Answer(grpc::CallbackServerContext* context,
                                                 const Order& order,
                                                 std::function<absl::Status(const Caller&)> call) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const CallRecord record(&manager_->metrics(), order.method);
  auto caller = authenticator_->Identify(*context, order.roles);
  if (!caller.ok()) {
    reactor->Finish(record.End(caller.status()));
    return reactor;
  }
  order.executor->Post([reactor, record, caller = *std::move(caller), call = std::move(call)] {
    reactor->Finish(record.End(call(caller)));
  });
  return reactor;
}

absl::StatusOr<amhex::v1::CostEstimate> MeshingService::Estimate(
    const Caller& caller, const amhex::v1::SubmitJobRequest& request) {
  AMHEX_ASSIGN_OR_RETURN(const AdmittedInput input,
                         manager_->AdmitInputOfEstimate(caller, request));
  const Limits& limits = manager_->options().limits;
  amhex::worker::RunJob order;
  order.set_input_path(manager_->PathOfBlob(input.blob.sha256()));
  order.set_input_encoding(request.input_encoding());
  order.mutable_input_limits()->set_max_point_count(limits.max_point_count);
  order.mutable_input_limits()->set_max_triangle_count(limits.max_triangle_count);
  order.mutable_input_limits()->set_max_attribute_count(limits.max_attribute_count);
  *order.mutable_params() = request.params();
  return pool_->Estimate(std::move(order));
}

absl::Status MeshingService::Submit(const Caller& caller,
                                    const grpc::CallbackServerContext& context,
                                    const amhex::v1::SubmitJobRequest& request,
                                    amhex::v1::SubmitJobResponse* response) {
  AMHEX_RETURN_IF_ERROR(CheckSubmit(request, manager_->options().limits));
  if (request.validate_only()) {
    AMHEX_ASSIGN_OR_RETURN(*response->mutable_estimate(), Estimate(caller, request));
    return absl::OkStatus();
  }
  Admission admission;
  admission.trace_parent = TraceParentOf(context);
  AMHEX_ASSIGN_OR_RETURN(*response->mutable_job(), manager_->Submit(caller, request, admission));
  return absl::OkStatus();
}

grpc::ServerUnaryReactor* MeshingService::SubmitJob(grpc::CallbackServerContext* context,
                                                    const amhex::v1::SubmitJobRequest* request,
                                                    amhex::v1::SubmitJobResponse* response) {
  BlockingExecutor* const executor = request->validate_only() ? &estimate_executor_ : executor_;
  return Answer(context, {"amhex.v1.Mesher/SubmitJob", executor, {Role::kSubmit}},
                [this, context, request, response](const Caller& caller) {
                  return Submit(caller, *context, *request, response);
                });
}

grpc::ServerUnaryReactor* MeshingService::GetJob(grpc::CallbackServerContext* context,
                                                 const amhex::v1::GetJobRequest* request,
                                                 Job* response) {
  return Answer(context, {"amhex.v1.Mesher/GetJob", executor_, {Role::kRead, Role::kReadAll}},
                [this, request, response](const Caller& caller) -> absl::Status {
                  AMHEX_ASSIGN_OR_RETURN(const std::string id, CheckJobName(request->name()));
                  AMHEX_ASSIGN_OR_RETURN(*response, manager_->Get(caller, id));
                  return absl::OkStatus();
                });
}

grpc::ServerUnaryReactor* MeshingService::ListJobs(grpc::CallbackServerContext* context,
                                                   const amhex::v1::ListJobsRequest* request,
                                                   amhex::v1::ListJobsResponse* response) {
  return Answer(context, {"amhex.v1.Mesher/ListJobs", executor_, {Role::kRead, Role::kReadAll}},
                [this, request, response](const Caller& caller) -> absl::Status {
                  AMHEX_ASSIGN_OR_RETURN(const JobQuery query,
                                         CheckList(*request, manager_->options().limits));
                  AMHEX_ASSIGN_OR_RETURN(JobPage page, manager_->List(caller, query));
                  for (Job& job : page.jobs) *response->add_jobs() = std::move(job);
                  if (page.next_before_number > 0) {
                    response->set_next_page_token(MakePageToken(*request, page.next_before_number));
                  }
                  return absl::OkStatus();
                });
}

grpc::ServerWriteReactor<amhex::v1::WatchJobResponse>* MeshingService::WatchJob(
    grpc::CallbackServerContext* context, const amhex::v1::WatchJobRequest* request) {
  return new WatchReactor(authenticator_->Identify(*context, {Role::kRead, Role::kReadAll}),
                          *request, manager_, executor_);
}

grpc::ServerUnaryReactor* MeshingService::CancelJob(grpc::CallbackServerContext* context,
                                                    const amhex::v1::CancelJobRequest* request,
                                                    Job* response) {
  return Answer(context, {"amhex.v1.Mesher/CancelJob", executor_, {Role::kSubmit}},
                [this, request, response](const Caller& caller) -> absl::Status {
                  AMHEX_ASSIGN_OR_RETURN(const std::string id, CheckJobName(request->name()));
                  AMHEX_ASSIGN_OR_RETURN(*response, manager_->Cancel(caller, id));
                  return absl::OkStatus();
                });
}

grpc::ServerUnaryReactor* MeshingService::DeleteJob(grpc::CallbackServerContext* context,
                                                    const amhex::v1::DeleteJobRequest* request,
                                                    google::protobuf::Empty*) {
  return Answer(context, {"amhex.v1.Mesher/DeleteJob", executor_, {Role::kSubmit}},
                [this, request](const Caller& caller) -> absl::Status {
                  AMHEX_ASSIGN_OR_RETURN(const std::string id, CheckJobName(request->name()));
                  return manager_->Delete(caller, id);
                });
}

grpc::ServerBidiReactor<amhex::v1::MeshRequest, amhex::v1::MeshResponse>* MeshingService::Mesh(
    grpc::CallbackServerContext* context) {
  auto caller = authenticator_->Identify(*context, {Role::kSubmit});
  if (caller.ok()) caller = authenticator_->Identify(*context, {Role::kRead, Role::kReadAll});
  const auto submit = [this, context](const Caller& submitter,
                                      const amhex::v1::SubmitJobRequest& request) {
    Admission admission;
    admission.trace_parent = TraceParentOf(*context);
    return manager_->Submit(submitter, request, admission);
  };
  return new MeshReactor(std::move(caller), {manager_, executor_, submit});
}

grpc::ServerUnaryReactor* MeshingService::GetCapabilities(grpc::CallbackServerContext* context,
                                                          const amhex::v1::GetCapabilitiesRequest*,
                                                          amhex::v1::Capabilities* response) {
  return Answer(
      context,
      {"amhex.v1.Mesher/GetCapabilities", executor_, {Role::kRead, Role::kSubmit, Role::kReadAll}},
      [this, response](const Caller&) -> absl::Status {
        const amhex::worker::Hello hello = pool_->hello();
        response->set_server_version(kServerVersion);
        response->set_engine_version(hello.engine_version());
        response->add_api_versions("amhex.v1");
        *response->mutable_limits() = ToProto(manager_->options().limits);
        *response->mutable_backends() = hello.backends();
        response->add_input_encodings(amhex::v1::INPUT_ENCODING_DRACO);
        response->add_input_encodings(amhex::v1::INPUT_ENCODING_ARRAYS);
        response->add_mesh_encodings(amhex::v1::MESH_ENCODING_ARRAYS);
        response->set_worker_count(pool_->ready_count());
        response->set_quarantined_worker_count(pool_->quarantined_count());
        response->set_draining(manager_->draining());
        return absl::OkStatus();
      });
}

}  // namespace amhex::server
