// One call's context: it carries the caller's token and is cancelled when the client is
// interrupted.
#pragma once

#include <grpcpp/client_context.h>

#include "amhex/client.h"

namespace amhex::client {

class InterruptibleCall {
 public:
  explicit InterruptibleCall(const ClientOptions& options) : interrupt_(options.interrupt) {
    if (!options.security.token.empty()) {
      context_.AddMetadata("authorization", "Bearer " + options.security.token);
    }
    if (interrupt_ != nullptr) interrupt_->Add(&context_);
  }
  ~InterruptibleCall() {
    if (interrupt_ != nullptr) interrupt_->Remove(&context_);
  }
  InterruptibleCall(const InterruptibleCall&) = delete;
  InterruptibleCall& operator=(const InterruptibleCall&) = delete;

  grpc::ClientContext* context() { return &context_; }

 private:
  Interrupt* interrupt_;  // may be null
  grpc::ClientContext context_;
};

}  // namespace amhex::client
