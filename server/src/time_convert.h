// absl times and spans to and from protobuf's.
#pragma once

#include "absl/time/time.h"
#include "google/protobuf/duration.pb.h"
#include "google/protobuf/timestamp.pb.h"

namespace amhex::server {

inline google::protobuf::Duration ToProto(absl::Duration span) {
  google::protobuf::Duration out;
  const int64_t seconds = absl::IDivDuration(span, absl::Seconds(1), &span);
  out.set_seconds(seconds);
  out.set_nanos(static_cast<int32_t>(absl::IDivDuration(span, absl::Nanoseconds(1), &span)));
  return out;
}

inline absl::Duration FromProto(const google::protobuf::Duration& span) {
  return absl::Seconds(span.seconds()) + absl::Nanoseconds(span.nanos());
}

inline google::protobuf::Timestamp ToProto(absl::Time time) {
  google::protobuf::Timestamp out;
  const int64_t seconds = absl::ToUnixSeconds(time);
  out.set_seconds(seconds);
  out.set_nanos(
      static_cast<int32_t>(absl::ToInt64Nanoseconds(time - absl::FromUnixSeconds(seconds))));
  return out;
}

inline absl::Time FromProto(const google::protobuf::Timestamp& time) {
  return absl::FromUnixSeconds(time.seconds()) + absl::Nanoseconds(time.nanos());
}

}  // namespace amhex::server
