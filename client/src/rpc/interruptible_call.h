// One call's context, cancelled when the client is interrupted.
#pragma once

#include <grpcpp/client_context.h>

#include "amhex/client.h"

namespace amhex::client {

class InterruptibleCall {
 public:
  // `interrupt` may be null.
  explicit InterruptibleCall(Interrupt* interrupt) : interrupt_(interrupt) {
    if (interrupt_ != nullptr) interrupt_->Add(&context_);
  }
  ~InterruptibleCall() {
    if (interrupt_ != nullptr) interrupt_->Remove(&context_);
  }
  InterruptibleCall(const InterruptibleCall&) = delete;
  InterruptibleCall& operator=(const InterruptibleCall&) = delete;

  grpc::ClientContext* context() { return &context_; }

 private:
  Interrupt* interrupt_;
  grpc::ClientContext context_;
};

}  // namespace amhex::client
