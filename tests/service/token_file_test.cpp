#include "token_file.h"

#include <gtest/gtest.h>

#include "sha256.h"

namespace amhex::server {
namespace {

std::string Problem(const std::string& text) {
  return std::string(TokenTable::Parse(text).status().message());
}

TEST(TokenFile, EmptyFileKnowsNobody) {
  const auto table = TokenTable::Parse("");
  ASSERT_TRUE(table.ok());
  EXPECT_EQ(table->Find(""), nullptr);
  EXPECT_EQ(table->Find("token"), nullptr);
}

TEST(TokenFile, TokenGivesTenantRolesAndBounds) {
  const auto table =
      TokenTable::Parse("# who may call\n\n  ada\tsubmit,read " + Sha256Hex("secret") +
                        " weight=2 max_queued=3 max_running=4 max_blob_bytes=5 # a comment\r\n");
  ASSERT_TRUE(table.ok()) << table.status();
  const Caller* caller = table->Find("secret");
  ASSERT_NE(caller, nullptr);
  EXPECT_EQ(caller->tenant.name, "ada");
  EXPECT_EQ(caller->tenant.weight, 2);
  EXPECT_EQ(caller->tenant.max_queued_jobs, 3);
  EXPECT_EQ(caller->tenant.max_running_jobs, 4);
  EXPECT_EQ(caller->tenant.max_blob_bytes, 5);
  EXPECT_TRUE(caller->Has(Role::kSubmit));
  EXPECT_FALSE(caller->Has(Role::kReadAll));
  EXPECT_EQ(table->Find("secreT"), nullptr);
  EXPECT_EQ(table->Find(Sha256Hex("secret")), nullptr);
}

TEST(TokenFile, RolesDecideWhatIsSeenAndRuled) {
  const auto table = TokenTable::Parse("ada submit,read " + Sha256Hex("a") + "\neve read-all " +
                                       Sha256Hex("e") + "\nroot admin " + Sha256Hex("r"));
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_TRUE(table->Find("a")->Sees("ada"));
  EXPECT_FALSE(table->Find("a")->Sees("bob"));
  EXPECT_TRUE(table->Find("e")->Sees("bob"));
  EXPECT_FALSE(table->Find("e")->Rules("bob"));
  EXPECT_TRUE(table->Find("r")->Rules("bob"));
}

TEST(TokenFile, WrongLinesAreNamed) {
  const std::string digest = Sha256Hex("a");
  EXPECT_NE(Problem("ada submit").find("line 1"), std::string::npos);
  EXPECT_NE(Problem("\nAda submit " + digest).find("line 2: the tenant's name"), std::string::npos);
  EXPECT_NE(Problem("ada write " + digest).find("role write"), std::string::npos);
  EXPECT_NE(Problem("ada submit secret").find("SHA-256"), std::string::npos);
  EXPECT_NE(Problem("ada submit " + digest + " weight=0").find("weight=0"), std::string::npos);
  EXPECT_NE(Problem("ada submit " + digest + " weight=1001").find("1000"), std::string::npos);
  EXPECT_NE(Problem("ada submit " + digest + " colour=1").find("colour=1"), std::string::npos);
  EXPECT_NE(Problem("ada submit " + digest + "\nbob submit " + digest).find("line 2"),
            std::string::npos);
}

TEST(TokenFile, NewTokensDiffer) {
  EXPECT_NE(NewToken(), NewToken());
  EXPECT_GE(NewToken().size(), 43u);
}

TEST(TokenFile, TenantNamesArePlain) {
  for (const char* good : {"a", "0", "team-1.berlin_x"}) EXPECT_TRUE(IsTenantName(good)) << good;
  for (const char* bad : {"", "-a", "A", "a b", "a/b", "\xc3\xa4"}) {
    EXPECT_FALSE(IsTenantName(bad)) << bad;
  }
  EXPECT_TRUE(IsTenantName(std::string(64, 'a')));
  EXPECT_FALSE(IsTenantName(std::string(65, 'a')));
}

}  // namespace
}  // namespace amhex::server
