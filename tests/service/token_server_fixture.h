// A server in this process that tells its callers apart by their tokens.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "files.h"
#include "scripted_server_fixture.h"

namespace amhex::server {

class TokenServerTest : public ScriptedServerTest {
 protected:
  // With `tokens` as the text of its token file.
  void StartWithTokens(const std::string& tokens) {
    WriteTokens(tokens);
    options_.tokens = folder_ / "tokens";
    Start();
  }

  void WriteTokens(const std::string& text) {
    ASSERT_TRUE(WriteFileAtomically(folder_ / "tokens", text).ok());
  }
};

}  // namespace amhex::server
