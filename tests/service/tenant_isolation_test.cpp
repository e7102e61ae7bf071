// What belongs to one tenant is to another as if it were not there, in every call of every service:
// a call that names it is answered like one that names what nobody has.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "google/rpc/status.pb.h"
#include "job.h"
#include "sha256.h"
#include "token_server_fixture.h"

namespace amhex::server {
namespace {

using amhex::v1::BlobRef;
using amhex::v1::Job;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

// A job and a blob that a request can name.
struct Named {
  std::string job;
  BlobRef blob;
};

// Names them wherever the message can; false if it cannot.
bool FillIn(const Named& named, Message* message) {
  const auto* descriptor = message->GetDescriptor();
  const auto* access = message->GetReflection();
  bool is_named = false;
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const FieldDescriptor* field = descriptor->field(i);
    if (field->name() == "name") {
      access->SetString(message, field, named.job);
      is_named = true;
    } else if (field->message_type() == BlobRef::descriptor()) {
      (field->is_repeated() ? access->AddMessage(message, field)
                            : access->MutableMessage(message, field))
          ->CopyFrom(named.blob);
      is_named = true;
    } else if (field->message_type() == amhex::v1::SubmitJobRequest::descriptor()) {
      is_named = FillIn(named, access->MutableMessage(message, field)) || is_named;
    }
  }
  return is_named;
}

class IsolationTest : public TokenServerTest {
 protected:
  void SetUp() override {
    StartWithTokens("ada submit,read " + Sha256Hex("ada's") + "\nbob submit,read " +
                    Sha256Hex("bob's") + "\n");
  }

  std::unique_ptr<grpc::ClientContext> As(const std::string& caller) {
    auto context = std::make_unique<grpc::ClientContext>();
    context->AddMetadata("authorization", "Bearer " + caller + "'s");
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    return context;
  }

  Job Run(const std::string& caller, amhex::v1::SubmitJobRequest request) {
    amhex::v1::SubmitJobResponse response;
    const auto status = mesher_->SubmitJob(As(caller).get(), request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    Job job;
    amhex::v1::GetJobRequest get;
    get.set_name(response.job().name());
    EXPECT_TRUE(Eventually(
        [&] { return mesher_->GetJob(As(caller).get(), get, &job).ok() && IsFinal(job.state()); }));
    return job;
  }

  // Everything that a call answers, the names that were asked for blotted out.
  std::string Answer(const std::string& caller, const MethodDescriptor& method,
                     const Named& named) {
    const std::unique_ptr<Message> request(google::protobuf::MessageFactory::generated_factory()
                                               ->GetPrototype(method.input_type())
                                               ->New());
    EXPECT_TRUE(FillIn(named, request.get())) << method.full_name();
    std::string answer;
    const grpc::Status status = Call(caller, method, *request, &answer);
    google::rpc::Status details;
    EXPECT_TRUE(details.ParseFromString(status.error_details()));
    // They come in any order.
    std::multiset<std::string> parts;
    for (const auto& detail : details.details()) parts.insert(detail.SerializeAsString());
    absl::StrAppend(&answer, "code ", status.error_code(), ": ", status.error_message(),
                    absl::StrJoin(parts, ""));
    return absl::StrReplaceAll(answer, {{named.job.substr(5), "ID"}, {named.blob.sha256(), "SHA"}});
  }

  grpc::Status Call(const std::string& caller, const MethodDescriptor& method,
                    const Message& request, std::string* answer) {
    grpc::GenericStub stub(channel_);
    const auto context = As(caller);
    grpc::CompletionQueue queue;
    const auto wait = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    auto call = stub.PrepareCall(context.get(),
                                 "/" + method.service()->full_name() + "/" + method.name(), &queue);
    call->StartCall(nullptr);
    wait();
    grpc::Slice slice(request.SerializeAsString());
    call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
    wait();
    grpc::ByteBuffer response;
    for (call->Read(&response, nullptr); wait(); call->Read(&response, nullptr)) {
      grpc::Slice bytes;
      EXPECT_TRUE(response.DumpToSingleSlice(&bytes).ok());
      answer->append(bytes.begin(), bytes.end());
    }
    grpc::Status status;
    call->Finish(&status, nullptr);
    wait();
    return status;
  }
};

TEST_F(IsolationTest, EveryCallAnswersAboutWhatOthersHaveAsAboutWhatNobodyHas) {
  const Job job = Run("ada", ScriptRequest("succeed mesh;"));
  ASSERT_EQ(job.state(), Job::SUCCEEDED);
  // These name neither a job nor a blob.
  const std::set<std::string> nameless = {"ListJobs", "GetCapabilities"};
  for (const BlobRef& blob : {job.input(), job.result().mesh()}) {
    Named hers{job.name(), blob};
    Named nobodys{"jobs/00000000-0000-7000-8000-000000000000", blob};
    nobodys.blob.set_sha256(std::string(64, 'a'));
    int count = 0;
    for (const char* service : {"amhex.v1.Mesher", "amhex.v1.Blobs"}) {
      const auto* descriptor =
          google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
      ASSERT_NE(descriptor, nullptr);
      for (int i = 0; i < descriptor->method_count(); ++i) {
        const MethodDescriptor& method = *descriptor->method(i);
        if (nameless.count(method.name()) == 1) continue;
        EXPECT_EQ(Answer("bob", method, hers), Answer("bob", method, nobodys)) << method.name();
        ++count;
      }
    }
    EXPECT_GE(count, 10);
  }
  // All the while it is there.
  const auto* reading = google::protobuf::DescriptorPool::generated_pool()->FindMethodByName(
      "amhex.v1.Mesher.GetJob");
  EXPECT_NE(Answer("ada", *reading, {job.name(), job.input()}).find("code 0"), std::string::npos);
}

TEST_F(IsolationTest, EstimatesAreNotMadeOfBlobsOfOthers) {
  const Job job = Run("ada", ScriptRequest("succeed mesh;"));
  amhex::v1::SubmitJobRequest request;
  request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  request.set_validate_only(true);
  *request.mutable_input_blob() = job.input();
  amhex::v1::SubmitJobResponse response;
  EXPECT_EQ(mesher_->SubmitJob(As("bob").get(), request, &response).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_TRUE(mesher_->SubmitJob(As("ada").get(), request, &response).ok());
}

TEST_F(IsolationTest, PageTokensAndRequestIdsOpenNothingOfOthers) {
  auto request = ScriptRequest("succeed mesh;");
  request.set_request_id("6f9619ff-8b86-4011-b42d-00c04fc964ff");
  const Job hers = Run("ada", request);
  const Job his = Run("bob", request);
  EXPECT_NE(hers.name(), his.name());
  for (int i = 0; i < 3; ++i) Run("ada", ScriptRequest("succeed mesh;"));
  amhex::v1::ListJobsRequest list;
  list.set_page_size(1);
  amhex::v1::ListJobsResponse page;
  ASSERT_TRUE(mesher_->ListJobs(As("ada").get(), list, &page).ok());
  ASSERT_NE(page.next_page_token(), "");
  list.set_page_token(page.next_page_token());
  list.set_page_size(100);
  ASSERT_TRUE(mesher_->ListJobs(As("bob").get(), list, &page).ok());
  ASSERT_EQ(page.jobs_size(), 1);
  EXPECT_EQ(page.jobs(0).name(), his.name());
}

}  // namespace
}  // namespace amhex::server
