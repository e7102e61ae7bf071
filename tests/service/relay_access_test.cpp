// Nodes that ask each other who they are: TLS and tokens between them, and replacing both.
#include "cluster_fixture.h"
#include "files.h"
#include "job_watcher.h"
#include "sha256.h"
#include "test_certificates.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr char kPeerToken[] = "of the nodes";
constexpr char kCallerToken[] = "ada's";

class RelayAccessTest : public ClusterTest {
 protected:
  void SetUp() override {
    Write("tokens", std::string("ada submit,read ") + Sha256Hex(kCallerToken) +
                        "\nnodes read-all " + Sha256Hex(kPeerToken) + "\n");
    Write("peer-token", std::string(kPeerToken) + "\n");
    WriteCertificates(&first_authority_);
    for (int number = 0; number < 2; ++number) {
      Node::Options options = NodeOptions(number);
      options.flags = {"--tls-cert", folder_ / "cert",   "--tls-key",    folder_ / "key",
                       "--tokens",   folder_ / "tokens", "--peer-token", folder_ / "peer-token",
                       "--peer-ca",  folder_ / "ca"};
      if (callers_show_certificates_) {
        for (const std::string& word : {std::string("--tls-client-ca"), folder_ / "ca"}) {
          options.flags.push_back(word);
        }
      }
      const PemPair own = first_authority_.Sign("ada");
      options.credentials =
          grpc::SslCredentials({first_authority_.certificate() + next_authority_.certificate(),
                                own.key, own.certificate});
      options.token = kCallerToken;
      nodes_.push_back(std::make_unique<Node>(options));
    }
  }

  void Write(const std::string& name, const std::string& text) {
    ASSERT_TRUE(WriteFileAtomically(folder_ / name, text).ok());
  }

  void WriteCertificates(TestAuthority* authority) {
    const PemPair pair = authority->Sign("node", OwnAddress());
    Write("ca", authority->certificate());
    Write("key", pair.key);
    Write("cert", pair.certificate);
  }

  bool ShowsProgress(const JobWatcher& watcher) {
    return Eventually([&] { return watcher.progress_count() >= 3; }, absl::Minutes(1));
  }

  bool callers_show_certificates_ = false;
  TestAuthority first_authority_;
  TestAuthority next_authority_;
};

class MutualRelayAccessTest : public RelayAccessTest {
 protected:
  MutualRelayAccessTest() { callers_show_certificates_ = true; }
};

TEST_F(MutualRelayAccessTest, ProgressPassesWhereBothSidesShowCertificatesAndTokens) {
  const std::string name = Submit(0, LongScript());
  const JobWatcher watcher(*nodes_[NodeBeside(name)], name);
  EXPECT_TRUE(ShowsProgress(watcher));
}

TEST_F(RelayAccessTest, WithAWrongTokenThereIsNoProgressUntilItIsReplaced) {
  Write("peer-token", "wrong");
  const std::string name = Submit(0, LongScript());
  JobWatcher watcher(*nodes_[NodeBeside(name)], name);
  ASSERT_TRUE(Eventually([&] { return watcher.state() == Job::RUNNING; }, absl::Minutes(1)));
  EXPECT_EQ(watcher.progress_count(), 0);
  Write("peer-token", kPeerToken);
  EXPECT_TRUE(ShowsProgress(watcher));
  Cancel(0, name);
  watcher.Join();
  EXPECT_EQ(watcher.state(), Job::CANCELLED);
}

TEST_F(RelayAccessTest, RunningNodeTrustsANewAuthorityOnceItsFileIsReplaced) {
  WriteCertificates(&next_authority_);
  EXPECT_EQ(nodes_[1]->Terminate(), 0);
  nodes_[1]->Start();  // shows a certificate that the first node's old file does not cover
  const std::string first = Submit(1, LongScript("first"));
  const std::string second = Submit(1, LongScript("second"));
  ASSERT_TRUE(Reaches(1, first, Job::RUNNING) && Reaches(1, second, Job::RUNNING));
  const JobWatcher watcher(*nodes_[0], Runner(first) == 1 ? first : second);
  EXPECT_TRUE(ShowsProgress(watcher));
}

}  // namespace
}  // namespace amhex::server
