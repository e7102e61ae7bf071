// What errors say: whatever is asked, and whatever is broken inside, no message shows a path, an
// address in memory or a statement of the database, and every one carries a documented reason.
#include <google/protobuf/descriptor.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <regex>

#include "amhex/v1/errors.pb.h"
#include "errors.h"
#include "files.h"
#include "google/rpc/error_details.pb.h"
#include "job.h"
#include "job_manager.h"
#include "scripted_server_fixture.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// Fills some of the fields, and those of messages within, with values at and beyond their bounds.
// Texts are made of letters that occur in no secret, since a message may repeat what it was sent.
class StrangeRequests {
 public:
  void Fill(Message* message, int depth = 0) {
    const auto* descriptor = message->GetDescriptor();
    for (int i = 0; i < descriptor->field_count(); ++i) {
      const FieldDescriptor* field = descriptor->field(i);
      if (Roll(3) == 0 || (depth > 3 && field->message_type() != nullptr)) continue;
      for (int n = field->is_repeated() ? Roll(4) : 1; n > 0; --n) Set(message, field, depth);
    }
  }

 private:
  int Roll(int sides) { return static_cast<int>(random_() % static_cast<uint32_t>(sides)); }

  int64_t Number() {
    constexpr int64_t kNumbers[] = {0, 1, -1, 101, 1 << 20, INT32_MIN, INT32_MAX};
    return kNumbers[static_cast<size_t>(Roll(7))];
  }

  std::string Text() {
    constexpr char kLetters[] = "qzjk'\";%\\ \n";
    std::string text;
    for (int n = Roll(4) * Roll(40); n > 0; --n) text += kLetters[Roll(sizeof(kLetters) - 1)];
    return Roll(4) == 0 ? std::string(64, 'b') : text;
  }

  void Set(Message* message, const FieldDescriptor* field, int depth) {
    const auto* access = message->GetReflection();
    const bool many = field->is_repeated();
    switch (field->cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        return Fill(
            many ? access->AddMessage(message, field) : access->MutableMessage(message, field),
            depth + 1);
      case FieldDescriptor::CPPTYPE_STRING:
        return many ? access->AddString(message, field, Text())
                    : access->SetString(message, field, Text());
      case FieldDescriptor::CPPTYPE_INT32:
        if (!many) access->SetInt32(message, field, static_cast<int32_t>(Number()));
        return;
      case FieldDescriptor::CPPTYPE_INT64:
        if (!many) access->SetInt64(message, field, Number() << Roll(30));
        return;
      case FieldDescriptor::CPPTYPE_DOUBLE:
        if (!many) access->SetDouble(message, field, 1e300 * static_cast<double>(Number()));
        return;
      case FieldDescriptor::CPPTYPE_ENUM:
        if (!many) access->SetEnumValue(message, field, static_cast<int>(Number()));
        return;
      case FieldDescriptor::CPPTYPE_BOOL:
        if (!many) access->SetBool(message, field, Roll(2) == 0);
        return;
      default:
        return;
    }
  }

  std::mt19937 random_{5};
};

class MessagesTest : public ScriptedServerTest {
 protected:
  // Counts errors, and looks at each as a whole: message and details.
  void Examine(const google::rpc::Status& error) {
    ++error_count_;
    const std::string all = error.DebugString();
    static const std::regex kInside(
        "/tmp|/home|/usr|0x[0-9a-f]{4}|SELECT|INSERT|UPDATE|DELETE|WHERE|sqlite|constraint|std::|"
        "\\.cpp|\\.db|errno",
        std::regex::optimize);
    EXPECT_FALSE(std::regex_search(all, kInside)) << all;
    EXPECT_EQ(all.find(folder_.path()), std::string::npos) << all;
    amhex::v1::ErrorReason reason;
    EXPECT_TRUE(amhex::v1::ErrorReason_Parse(ReasonOf(error), &reason)) << all;
  }

  void Examine(const grpc::Status& status) {
    if (status.ok()) return;
    google::rpc::Status details;
    EXPECT_TRUE(details.ParseFromString(status.error_details()));
    EXPECT_EQ(details.message(), status.error_message());
    EXPECT_EQ(details.code(), static_cast<int>(status.error_code()));
    Examine(details);
  }

  template <class Stub, class Request, class Response>
  void Call(Stub* stub,
            grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
            const Request& request) {
    grpc::ClientContext context;
    Response response;
    Examine((stub->*method)(&context, request, &response));
  }

  template <class Reader>
  void Drain(std::unique_ptr<Reader> stream) {
    for (amhex::v1::ReadBlobResponse chunk; stream->Read(&chunk);) {
    }
    Examine(stream->Finish());
  }

  void Read(const std::string& sha256) {
    grpc::ClientContext context;
    amhex::v1::ReadBlobRequest request;
    request.mutable_blob()->set_sha256(sha256);
    Drain(blobs_->ReadBlob(&context, request));
  }

  void Write(const amhex::v1::WriteBlobRequest& chunk) {
    grpc::ClientContext context;
    amhex::v1::WriteBlobResponse response;
    const auto stream = blobs_->WriteBlob(&context, &response);
    stream->Write(chunk);
    stream->WritesDone();
    Examine(stream->Finish());
  }

  void MeshCall(const amhex::v1::MeshRequest& first) {
    grpc::ClientContext context;
    const auto stream = mesher_->Mesh(&context);
    stream->Write(first);
    stream->WritesDone();
    for (amhex::v1::MeshResponse event; stream->Read(&event);) {
    }
    Examine(stream->Finish());
  }

  void Watch(const amhex::v1::WatchJobRequest& request) {
    grpc::ClientContext context;
    const auto stream = mesher_->WatchJob(&context, request);
    for (amhex::v1::WatchJobResponse frame; stream->Read(&frame);) {
    }
    Examine(stream->Finish());
  }

  int error_count_ = 0;
};

using MesherStub = amhex::v1::Mesher::Stub;
using BlobsStub = amhex::v1::Blobs::Stub;

TEST_F(MessagesTest, StrangeRequestsAreAnsweredWithoutAWordOfTheInside) {
  Start();
  StrangeRequests strange;
  const auto any = [&](auto request) {
    strange.Fill(&request);
    return request;
  };
  constexpr int kRounds = 60;
  for (int round = 0; round < kRounds; ++round) {
    Call(mesher_.get(), &MesherStub::SubmitJob, any(amhex::v1::SubmitJobRequest()));
    Call(mesher_.get(), &MesherStub::GetJob, any(amhex::v1::GetJobRequest()));
    Call(mesher_.get(), &MesherStub::ListJobs, any(amhex::v1::ListJobsRequest()));
    Call(mesher_.get(), &MesherStub::CancelJob, any(amhex::v1::CancelJobRequest()));
    Call(mesher_.get(), &MesherStub::DeleteJob, any(amhex::v1::DeleteJobRequest()));
    Call(blobs_.get(), &BlobsStub::QueryWriteStatus, any(amhex::v1::QueryWriteStatusRequest()));
    Call(blobs_.get(), &BlobsStub::FindMissingBlobs, any(amhex::v1::FindMissingBlobsRequest()));
    Watch(any(amhex::v1::WatchJobRequest()));
    MeshCall(any(amhex::v1::MeshRequest()));
    Write(any(amhex::v1::WriteBlobRequest()));
    grpc::ClientContext context;
    Drain(blobs_->ReadBlob(&context, any(amhex::v1::ReadBlobRequest())));
  }
  EXPECT_GT(error_count_, 5 * kRounds);
}

TEST_F(MessagesTest, FaultsOfTheStoresAreToldWithoutAWordOfTheInside) {
  Start();
  const auto submit = [&](const std::string& script) {
    Call(mesher_.get(), &MesherStub::SubmitJob, ScriptRequest(script));
  };
  submit("succeed mesh;");
  // A folder where the bytes should be.
  const std::string path = server_->manager().PathOfBlob(Sha256Hex(ScriptInput("succeed mesh;")));
  ASSERT_EQ(std::remove(path.c_str()), 0);
  ASSERT_TRUE(MakeFolders(path).ok());
  Read(Sha256Hex(ScriptInput("succeed mesh;")));
  EXPECT_EQ(error_count_, 1);
  // A database that is none.
  for (const char* name : {"/jobs.db", "/jobs.db-wal"}) {
    std::fstream file(options_.data_dir + name, std::ios::in | std::ios::out | std::ios::binary);
    ASSERT_TRUE(file.good()) << name;
    file << std::string(1 << 16, 'j');
  }
  for (int i = 0; i < 5; ++i) {
    submit("succeed other;");
    Call(mesher_.get(), &MesherStub::ListJobs, amhex::v1::ListJobsRequest());
  }
}

TEST_F(MessagesTest, FailedJobsSayNothingOfTheInsideEither) {
  options_.worker = AMHEX_REAL_WORKER;
  Start();
  std::mt19937 random(6);
  constexpr int kInputs = 24;
  for (int i = 0; i < kInputs; ++i) {
    std::string bytes = i % 2 == 0 ? CubeInput() : DracoFileHeader(2, 2, 1, i % 4 / 2);
    if (i % 2 != 0) bytes += std::string(200, static_cast<char>(random()));
    for (int change = 0; change < 3; ++change) {
      bytes[11 + random() % (bytes.size() - 11)] = static_cast<char>(random());
    }
    amhex::v1::SubmitJobRequest request;
    request.set_input_encoding(i % 2 == 0 ? amhex::v1::INPUT_ENCODING_ARRAYS
                                          : amhex::v1::INPUT_ENCODING_DRACO);
    request.set_inline_input(bytes);
    request.mutable_params()->mutable_sizing()->set_cell_count(20);
    amhex::v1::SubmitJobResponse response;
    grpc::ClientContext context;
    const grpc::Status status = mesher_->SubmitJob(&context, request, &response);
    Examine(status);
    if (!status.ok()) continue;
    amhex::v1::WatchJobRequest watch;
    watch.set_name(response.job().name());
    Watch(watch);
    grpc::ClientContext again;
    amhex::v1::GetJobRequest get;
    get.set_name(watch.name());
    Job job;
    ASSERT_TRUE(mesher_->GetJob(&again, get, &job).ok());
    ASSERT_TRUE(IsFinal(job.state()));
    if (job.has_error()) Examine(job.error());
  }
  EXPECT_GT(error_count_, kInputs / 2);
}

TEST_F(MessagesTest, TraceParentIsCarriedIfItIsOne) {
  Start();
  const auto carried = [&](const std::string& header) {
    grpc::ClientContext context;
    context.AddMetadata("traceparent", header);
    amhex::v1::SubmitJobResponse response;
    EXPECT_TRUE(mesher_->SubmitJob(&context, ScriptRequest("succeed mesh;"), &response).ok());
    return response.job().trace_parent();
  };
  const std::string good = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  EXPECT_EQ(carried(good), good);
  for (const char* bad : {"", "00", "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
                          "004bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-",
                          "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
                          "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
                          "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01"}) {
    EXPECT_EQ(carried(bad), "") << bad;
  }
}

}  // namespace
}  // namespace amhex::server
