// Who gets in, and what one tenant can learn of another: every call of every service.
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <fstream>

#include "error_reason.h"
#include "files.h"
#include "health_client.h"
#include "job.h"
#include "job_manager.h"
#include "sha256.h"
#include "test_certificates.h"
#include "token_server_fixture.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

// A server, and callers told apart by their tokens.
class AccessTest : public TokenServerTest {
 protected:
  void SetUp() override {
    StartWithTokens("ada submit,read " + Sha256Hex("ada's") +
                    " max_queued=3 max_blob_bytes=10000\n" + "bob submit,read " +
                    Sha256Hex("bob's") + "\n" +                        //
                    "viewer read " + Sha256Hex("viewer's") + "\n" +    //
                    "sender submit " + Sha256Hex("sender's") + "\n" +  //
                    "auditor read-all " + Sha256Hex("auditor's") + "\n" + "root admin " +
                    Sha256Hex("root's") + "\n");
  }

  std::unique_ptr<grpc::ClientContext> As(const std::string& token) {
    auto context = std::make_unique<grpc::ClientContext>();
    if (!token.empty()) context->AddMetadata("authorization", "Bearer " + token);
    return context;
  }

  grpc::Status Submit(const std::string& token, const amhex::v1::SubmitJobRequest& request,
                      Job* job) {
    amhex::v1::SubmitJobResponse response;
    const auto status = mesher_->SubmitJob(As(token).get(), request, &response);
    *job = response.job();
    return status;
  }

  // Submits and waits for the end.
  Job Run(const std::string& token, const std::string& script) {
    Job job;
    const auto status = Submit(token, ScriptRequest(script), &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_TRUE(
        Eventually([&] { return Get(token, job.name(), &job).ok() && IsFinal(job.state()); }));
    return job;
  }

  grpc::Status Get(const std::string& token, const std::string& name, Job* job) {
    amhex::v1::GetJobRequest request;
    request.set_name(name);
    return mesher_->GetJob(As(token).get(), request, job);
  }

  grpc::Status Watch(const std::string& token, const std::string& name) {
    amhex::v1::WatchJobRequest request;
    request.set_name(name);
    const auto context = As(token);
    const auto stream = mesher_->WatchJob(context.get(), request);
    for (amhex::v1::WatchJobResponse frame; stream->Read(&frame);) {
    }
    return stream->Finish();
  }

  grpc::Status Cancel(const std::string& token, const std::string& name) {
    amhex::v1::CancelJobRequest request;
    request.set_name(name);
    Job job;
    return mesher_->CancelJob(As(token).get(), request, &job);
  }

  grpc::Status Delete(const std::string& token, const std::string& name) {
    amhex::v1::DeleteJobRequest request;
    request.set_name(name);
    google::protobuf::Empty nothing;
    return mesher_->DeleteJob(As(token).get(), request, &nothing);
  }

  std::vector<std::string> List(const std::string& token) {
    amhex::v1::ListJobsResponse response;
    EXPECT_TRUE(mesher_->ListJobs(As(token).get(), {}, &response).ok());
    std::vector<std::string> names;
    for (const Job& job : response.jobs()) names.push_back(job.name());
    return names;
  }

  grpc::Status Read(const std::string& token, const amhex::v1::BlobRef& blob, std::string* bytes) {
    amhex::v1::ReadBlobRequest request;
    *request.mutable_blob() = blob;
    const auto context = As(token);
    const auto stream = blobs_->ReadBlob(context.get(), request);
    bytes->clear();
    for (amhex::v1::ReadBlobResponse chunk; stream->Read(&chunk);) *bytes += chunk.data();
    return stream->Finish();
  }

  // Sends the bytes from `offset` up to `size`; with the last one the blob ends.
  grpc::Status Write(const std::string& token, const std::string& bytes, size_t size,
                     amhex::v1::WriteBlobResponse* response, size_t offset = 0) {
    const auto context = As(token);
    const auto stream = blobs_->WriteBlob(context.get(), response);
    amhex::v1::WriteBlobRequest chunk;
    *chunk.mutable_blob() = RefOf(bytes);
    chunk.set_offset(static_cast<int64_t>(offset));
    chunk.set_data(bytes.substr(offset, size - offset));
    chunk.set_finish(size == bytes.size());
    stream->Write(chunk);
    stream->WritesDone();
    return stream->Finish();
  }

  amhex::v1::QueryWriteStatusResponse Query(const std::string& token, const std::string& bytes) {
    amhex::v1::QueryWriteStatusRequest request;
    *request.mutable_blob() = RefOf(bytes);
    amhex::v1::QueryWriteStatusResponse response;
    EXPECT_TRUE(blobs_->QueryWriteStatus(As(token).get(), request, &response).ok());
    return response;
  }

  bool IsMissing(const std::string& token, const amhex::v1::BlobRef& blob) {
    amhex::v1::FindMissingBlobsRequest request;
    *request.add_blobs() = blob;
    amhex::v1::FindMissingBlobsResponse response;
    EXPECT_TRUE(blobs_->FindMissingBlobs(As(token).get(), request, &response).ok());
    return response.missing_blobs_size() == 1;
  }

  static amhex::v1::BlobRef RefOf(const std::string& bytes) {
    amhex::v1::BlobRef blob;
    blob.set_sha256(Sha256Hex(bytes));
    blob.set_size_bytes(static_cast<int64_t>(bytes.size()));
    return blob;
  }
};

// Calls a method with an empty message, whatever its kind; gives its status.
grpc::Status CallEmpty(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                       const std::string& token) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  auto call = stub.PrepareCall(&context, method, &queue);
  call->StartCall(nullptr);
  wait();
  grpc::Slice empty;
  call->WriteLast(grpc::ByteBuffer(&empty, 1), grpc::WriteOptions(), nullptr);
  wait();
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return status;
}

TEST_F(AccessTest, NoCallOfAnyServiceAnswersAStranger) {
  int count = 0;
  for (const char* service : {"amhex.v1.Mesher", "amhex.v1.Blobs"}) {
    const auto* descriptor =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
    ASSERT_NE(descriptor, nullptr);
    for (int i = 0; i < descriptor->method_count(); ++i) {
      const std::string method = std::string("/") + service + "/" + descriptor->method(i)->name();
      for (const char* token : {"", "nobody's", "ada"}) {
        const grpc::Status status = CallEmpty(channel_, method, token);
        EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << method;
        EXPECT_EQ(Reason(status), "NOT_AUTHENTICATED") << method;
      }
      ++count;
    }
  }
  EXPECT_GE(count, 11);
}

TEST_F(AccessTest, HealthIsForEverybody) {
  EXPECT_EQ(HealthClient(channel_).Check(""), HealthClient::kServing);
}

TEST_F(AccessTest, ReaderCannotChangeAnything) {
  for (const char* method :
       {"/amhex.v1.Mesher/Mesh", "/amhex.v1.Mesher/SubmitJob", "/amhex.v1.Mesher/CancelJob",
        "/amhex.v1.Mesher/DeleteJob", "/amhex.v1.Blobs/WriteBlob",
        "/amhex.v1.Blobs/QueryWriteStatus", "/amhex.v1.Blobs/FindMissingBlobs"}) {
    const grpc::Status status = CallEmpty(channel_, method, "viewer's");
    EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED) << method;
    EXPECT_EQ(Reason(status), "ROLE_MISSING") << method;
  }
  amhex::v1::Capabilities capabilities;
  EXPECT_TRUE(mesher_->GetCapabilities(As("viewer's").get(), {}, &capabilities).ok());
}

TEST_F(AccessTest, SenderWhoMayNotReadCannotMeshInOneCall) {
  EXPECT_EQ(CallEmpty(channel_, "/amhex.v1.Mesher/Mesh", "sender's").error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(CallEmpty(channel_, "/amhex.v1.Mesher/Mesh", "ada's").error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(AccessTest, JobsOfOthersAreAsIfTheyWereNotThere) {
  const Job job = Run("ada's", "succeed mesh;");
  Job seen;
  const std::string absent = "jobs/00000000-0000-7000-8000-000000000000";
  for (const auto& [mine, none] :
       {std::pair{Get("bob's", job.name(), &seen), Get("bob's", absent, &seen)},
        std::pair{Watch("bob's", job.name()), Watch("bob's", absent)},
        std::pair{Cancel("bob's", job.name()), Cancel("bob's", absent)},
        std::pair{Delete("bob's", job.name()), Delete("bob's", absent)}}) {
    EXPECT_EQ(mine.error_code(), grpc::StatusCode::NOT_FOUND);
    EXPECT_EQ(Reason(mine), Reason(none));
    // The same words, but for the name that was asked for.
    EXPECT_EQ(mine.error_message().size(), none.error_message().size());
  }
  EXPECT_TRUE(List("bob's").empty());
  EXPECT_EQ(List("ada's"), std::vector<std::string>{job.name()});
  EXPECT_TRUE(Get("ada's", job.name(), &seen).ok());
}

TEST_F(AccessTest, BlobsOfOthersAreAsIfTheyWereNotThere) {
  const Job job = Run("ada's", "succeed mesh;");
  std::string bytes;
  for (const auto& blob : {job.input(), job.result().mesh()}) {
    EXPECT_TRUE(Read("ada's", blob, &bytes).ok());
    EXPECT_EQ(Reason(Read("bob's", blob, &bytes)), "BLOB_NOT_FOUND");
    EXPECT_FALSE(IsMissing("ada's", blob));
    EXPECT_TRUE(IsMissing("bob's", blob));
  }
  EXPECT_FALSE(Query("bob's", "mesh").complete());
  amhex::v1::SubmitJobRequest request;
  request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  *request.mutable_input_blob() = job.input();
  Job other;
  EXPECT_EQ(Reason(Submit("bob's", request, &other)), "BLOB_MISSING");
  EXPECT_TRUE(Submit("ada's", request, &other).ok());
}

TEST_F(AccessTest, ABlobBelongsToWhoeverHasShownAllItsBytes) {
  const std::string bytes(1000, 'x');
  amhex::v1::WriteBlobResponse response;
  ASSERT_TRUE(Write("ada's", bytes, bytes.size(), &response).ok());
  EXPECT_TRUE(Query("ada's", bytes).complete());
  // Another tenant begins at 0 and owns nothing until the end.
  EXPECT_EQ(Query("bob's", bytes).committed_size(), 0);
  ASSERT_TRUE(Write("bob's", bytes, 10, &response).ok());
  EXPECT_FALSE(response.complete());
  EXPECT_EQ(Query("bob's", bytes).committed_size(), 10);
  std::string got;
  EXPECT_EQ(Reason(Read("bob's", RefOf(bytes), &got)), "BLOB_NOT_FOUND");
  ASSERT_EQ(Reason(Write("bob's", bytes, bytes.size(), &response)), "WRONG_OFFSET");
  ASSERT_TRUE(Write("bob's", bytes, bytes.size(), &response, 10).ok());
  EXPECT_TRUE(response.complete());
  EXPECT_TRUE(Read("bob's", RefOf(bytes), &got).ok());
  EXPECT_EQ(got, bytes);
}

TEST_F(AccessTest, ResultsAreSharedWithinATenantOnly) {
  const std::string count = folder_ / "count";
  const std::string script = "touch " + count + "; succeed mesh;";
  const Job first = Run("ada's", script);
  EXPECT_FALSE(first.shared_result());
  EXPECT_TRUE(Run("ada's", script).shared_result());
  EXPECT_FALSE(Run("bob's", script).shared_result());
  EXPECT_EQ(*ReadWholeFile(count), "here\nhere\n");
}

TEST_F(AccessTest, QuotasBindTheirTenantOnly) {
  Job job;
  ASSERT_TRUE(Submit("bob's", ScriptRequest("progress 1; sleep 60000;"), &job).ok());
  ASSERT_TRUE(Eventually(
      [&] { return Get("bob's", job.name(), &job).ok() && job.state() == Job::RUNNING; }));
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(Submit("ada's", ScriptRequest("fail;" + std::to_string(i)), &job).ok());
  }
  EXPECT_EQ(Reason(Submit("ada's", ScriptRequest("fail; 4"), &job)), "QUOTA_EXCEEDED");
  EXPECT_TRUE(Submit("bob's", ScriptRequest("fail; 4"), &job).ok());
  const std::string large(10001, 'x');
  amhex::v1::WriteBlobResponse response;
  EXPECT_EQ(Reason(Write("ada's", large, large.size(), &response)), "QUOTA_EXCEEDED");
  EXPECT_TRUE(Write("bob's", large, large.size(), &response).ok());
}

TEST_F(AccessTest, NothingATenantStoresPassesItsQuota) {
  const std::string half(5001, 'x');
  Job job;
  // Neither estimates and refused submissions, whose inputs are kept for a while, ...
  auto estimate = ScriptRequest("succeed mesh;" + half);
  estimate.set_validate_only(true);
  EXPECT_TRUE(Submit("ada's", estimate, &job).ok());
  EXPECT_EQ(Reason(Submit("ada's", ScriptRequest("fail;" + half), &job)), "QUOTA_EXCEEDED");
  // ... nor what is uploaded beside them, ...
  amhex::v1::WriteBlobResponse response;
  EXPECT_EQ(Reason(Write("ada's", half, half.size(), &response)), "QUOTA_EXCEEDED");
  // ... and what it has stored stands in nobody's way, also not in its own.
  estimate.set_validate_only(false);
  estimate.set_request_id("6f9619ff-8b86-4011-b42d-00c04fc964ff");
  ASSERT_TRUE(Submit("ada's", estimate, &job).ok());
  Job again;
  EXPECT_TRUE(Submit("ada's", estimate, &again).ok());
  EXPECT_EQ(again.name(), job.name());
  EXPECT_TRUE(Write("bob's", half, half.size(), &response).ok());
}

TEST_F(AccessTest, AuditorSeesAllAndChangesNothingAdministratorChangesAll) {
  const Job job = Run("ada's", "succeed mesh;");
  Job seen;
  std::string bytes;
  EXPECT_TRUE(Get("auditor's", job.name(), &seen).ok());
  EXPECT_EQ(seen.tenant(), "ada");
  EXPECT_TRUE(Read("auditor's", job.result().mesh(), &bytes).ok());
  EXPECT_EQ(bytes, "mesh");
  EXPECT_EQ(List("auditor's"), std::vector<std::string>{job.name()});
  EXPECT_EQ(Reason(Delete("auditor's", job.name())), "ROLE_MISSING");
  EXPECT_TRUE(Delete("root's", job.name()).ok());
}

TEST_F(AccessTest, NewTokensCountWithoutARestartAndAWrongFileLeavesTheOldOnes) {
  const auto works = [&](const std::string& token) {
    amhex::v1::Capabilities capabilities;
    return mesher_->GetCapabilities(As(token).get(), {}, &capabilities).ok();
  };
  ASSERT_TRUE(works("ada's"));
  WriteTokens("ada read " + Sha256Hex("ada's new"));
  EXPECT_TRUE(Eventually([&] { return works("ada's new"); }));
  EXPECT_FALSE(works("ada's"));
  WriteTokens("nonsense");
  EXPECT_FALSE(Eventually([&] { return !works("ada's new"); }, absl::Milliseconds(1500)));
  // Whoever empties the file means it.
  WriteTokens("");
  EXPECT_TRUE(Eventually([&] { return !works("ada's new"); }));
}

// TLS: who the server is, and who the caller is by certificate.
class TlsTest : public ::testing::Test {
 protected:
  void Start() {
    const PemPair pair = authority_.Sign("localhost");
    ASSERT_TRUE(WriteFileAtomically(folder_ / "cert", pair.certificate).ok());
    ASSERT_TRUE(WriteFileAtomically(folder_ / "key", pair.key).ok());
    ASSERT_TRUE(WriteFileAtomically(folder_ / "ca", authority_.certificate()).ok());
    options_.listen = {"127.0.0.1:0"};
    options_.metrics_listen = "";
    options_.ephemeral = true;
    options_.worker = AMHEX_SCRIPTED_WORKER;
    options_.tls.certificate = folder_ / "cert";
    options_.tls.key = folder_ / "key";
    auto created = Server::Create(options_);
    ASSERT_TRUE(created.ok()) << created.status();
    server_ = *std::move(created);
  }

  // Lists the jobs over a fresh connection.
  grpc::Status Call(const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                    amhex::v1::ListJobsResponse* response) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel =
        grpc::CreateCustomChannel(server_->addresses().front(), credentials, arguments);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    return amhex::v1::Mesher::NewStub(channel)->ListJobs(&context, {}, response);
  }

  std::shared_ptr<grpc::ChannelCredentials> Trusting(const TestAuthority& authority,
                                                     const PemPair& own = {}) {
    return grpc::SslCredentials({authority.certificate(), own.key, own.certificate});
  }

  TestAuthority authority_;
  TemporaryFolder folder_;
  ServerOptions options_;
  std::unique_ptr<Server> server_;
  amhex::v1::ListJobsResponse response_;
};

TEST_F(TlsTest, OnlyTrustedAndEncryptedConnectionsWork) {
  Start();
  EXPECT_TRUE(Call(Trusting(authority_), &response_).ok());
  EXPECT_FALSE(Call(Trusting(TestAuthority()), &response_).ok());
  EXPECT_FALSE(Call(grpc::InsecureChannelCredentials(), &response_).ok());
}

TEST_F(TlsTest, RenewedCertificateServesNewConnectionsWithoutARestart) {
  Start();
  ASSERT_TRUE(Call(Trusting(authority_), &response_).ok());
  TestAuthority next;
  const PemPair pair = next.Sign("localhost");
  ASSERT_TRUE(WriteFileAtomically(folder_ / "key", pair.key).ok());
  ASSERT_TRUE(WriteFileAtomically(folder_ / "cert", pair.certificate).ok());
  EXPECT_TRUE(Eventually([&] { return Call(Trusting(next), &response_).ok(); }));
}

TEST_F(TlsTest, CertificateNamesTheTenant) {
  options_.tls.client_ca = folder_ / "ca";
  Start();
  EXPECT_FALSE(Call(Trusting(authority_), &response_).ok());
  TestAuthority strange;
  EXPECT_FALSE(Call(Trusting(authority_, strange.Sign("ada")), &response_).ok());
  Caller ada = Everyone();
  ada.tenant.name = "ada";
  const auto manager_job = server_->manager().Submit(ada, ScriptRequest("succeed mesh;"));
  ASSERT_TRUE(manager_job.ok()) << manager_job.status();
  ASSERT_TRUE(Call(Trusting(authority_, authority_.Sign("ada")), &response_).ok());
  EXPECT_EQ(response_.jobs_size(), 1);
  ASSERT_TRUE(Call(Trusting(authority_, authority_.Sign("bob")), &response_).ok());
  EXPECT_EQ(response_.jobs_size(), 0);
  EXPECT_EQ(Call(Trusting(authority_, authority_.Sign("No Tenant")), &response_).error_code(),
            grpc::StatusCode::UNAUTHENTICATED);
}

TEST(AccessOptions, OpenAddressesNeedTlsAndKnownCallers) {
  TestAuthority authority;
  TemporaryFolder folder;
  const PemPair pair = authority.Sign("localhost");
  ASSERT_TRUE(WriteFileAtomically(folder / "cert", pair.certificate).ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "key", pair.key).ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "other", authority.Sign("localhost").key).ok());
  ServerOptions options;
  options.worker = AMHEX_SCRIPTED_WORKER;
  options.listen = {"0.0.0.0:0"};
  EXPECT_FALSE(Validate(options).ok());
  options.tls.certificate = folder / "cert";
  EXPECT_FALSE(Validate(options).ok());
  options.tls.key = folder / "other";
  EXPECT_NE(Validate(options).message().find("does not belong"), std::string::npos);
  options.tls.key = folder / "key";
  EXPECT_NE(Validate(options).message().find("by anybody"), std::string::npos);
  options.tokens = folder / "tokens";
  EXPECT_TRUE(Validate(options).ok()) << Validate(options);
  EXPECT_FALSE(Server::Create(options).ok()) << "there is no such token file";
}

}  // namespace
}  // namespace amhex::server
