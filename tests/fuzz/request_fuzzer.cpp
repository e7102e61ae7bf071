// Every request's validation, page tokens and offsets, and the token file. The first byte chooses
// which; the rest is the message as it comes from the wire. A verdict is OK or INVALID_ARGUMENT,
// and fits into an answer.
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>

#include "errors.h"
#include "google/protobuf/stubs/logging.h"
#include "request_checks.h"
#include "token_file.h"

namespace amhex::server {
namespace {

// gRPC's default bound of an answer's trailers.
constexpr size_t kMaxTrailerBytes = 8192;

void Expect(bool condition) {
  if (!condition) std::abort();
}

void ExpectVerdict(const absl::Status& status) {
  Expect(status.ok() || absl::IsInvalidArgument(status));
  if (!status.ok()) Expect(ToRpcStatus(status).ByteSizeLong() < kMaxTrailerBytes);
}

template <class Request, class Check>
void Try(const std::string& bytes, const Check& check) {
  Request request;
  if (request.ParseFromString(bytes)) check(request);
}

void TryList(const amhex::v1::ListJobsRequest& request) {
  const auto query = CheckList(request, Limits());
  ExpectVerdict(query.status());
  if (!query.ok()) return;
  Expect(query->page_size >= 1 && query->page_size <= Limits().max_page_size);
  // A token for these filters comes back as the number it was made of.
  amhex::v1::ListJobsRequest next = request;
  next.set_page_token(MakePageToken(request, 12345));
  const auto again = CheckList(next, Limits());
  Expect(again.ok() && again->before_number == 12345);
}

void TryRead(const amhex::v1::ReadBlobRequest& request) {
  const absl::Status verdict = CheckRead(request);
  ExpectVerdict(verdict);
  if (!verdict.ok()) return;
  constexpr int64_t kSizes[] = {0, 1, 1 << 20, std::numeric_limits<int64_t>::max()};
  for (const int64_t size : kSizes) {
    const auto range = RangeToRead(request, size);
    if (range.ok()) {
      Expect(range->begin == request.offset() && range->begin <= range->end && range->end <= size);
      Expect(request.limit() == 0 || range->end - range->begin <= request.limit());
    } else {
      Expect(absl::IsOutOfRange(range.status()) && request.offset() > size);
    }
  }
}

}  // namespace
}  // namespace amhex::server

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace amhex::server;
  namespace v1 = amhex::v1;
  static const auto kSilenced = google::protobuf::SetLogHandler(nullptr);
  static_cast<void>(kSilenced);
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Limits limits;
  switch (data[0] % 8) {
    case 0:
      Try<v1::SubmitJobRequest>(
          bytes, [&](const auto& request) { ExpectVerdict(CheckSubmit(request, limits)); });
      Try<v1::MeshRequest>(
          bytes, [&](const auto& request) { ExpectVerdict(CheckMeshBegin(request, limits)); });
      break;
    case 1:
      Try<v1::ListJobsRequest>(bytes, TryList);
      break;
    case 2:
      Try<v1::WatchJobRequest>(bytes,
                               [](const auto& request) { ExpectVerdict(CheckWatch(request)); });
      break;
    case 3:
      Try<v1::ReadBlobRequest>(bytes, TryRead);
      break;
    case 4:
      Try<v1::WriteBlobRequest>(bytes, [&](const auto& request) {
        ExpectVerdict(CheckBlobToWrite(request.blob(), limits));
        ExpectVerdict(CheckBlobRef(request.blob()));  // as QueryWriteStatus does
      });
      break;
    case 5:
      Try<v1::FindMissingBlobsRequest>(
          bytes, [](const auto& request) { ExpectVerdict(CheckFindMissing(request)); });
      break;
    case 6:
      ExpectVerdict(CheckJobName(bytes).status());
      break;
    default:
      ExpectVerdict(TokenTable::Parse(bytes).status());
  }
  return 0;
}
