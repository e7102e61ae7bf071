#include "job_id.h"
#include "job_store_laws.h"

namespace amhex::server {

using amhex::v1::Job;

void JobStoreLaws::SetUp() {
  place_ = GetParam().make_durable();
  Reopen();
}

void JobStoreLaws::Reopen() {
  store_.reset();
  auto opened = place_->Open();
  ASSERT_TRUE(opened.ok()) << opened.status();
  store_ = *std::move(opened);
}

NewJob JobStoreLaws::Make(int priority) {
  NewJob fresh;
  fresh.id = MakeUuid(now_);
  fresh.request_hash = "hash";
  fresh.ttl = absl::Hours(1);
  fresh.job.set_priority(priority);
  fresh.job.set_max_attempts(2);
  fresh.job.mutable_input()->set_sha256("input");
  fresh.job.mutable_input()->set_size_bytes(10);
  return fresh;
}

NewJob JobStoreLaws::MakeFor(const std::string& tenant) {
  NewJob fresh = Make();
  fresh.tenant.name = tenant;
  return fresh;
}

std::string JobStoreLaws::Submit(const NewJob& job) {
  const auto submitted = store_->Submit(job, kManyJobs, now_);
  EXPECT_TRUE(submitted.ok()) << submitted.status();
  return job.id;
}

ClaimedJob JobStoreLaws::Claim(const Claimant& claimant) {
  auto claimed = store_->Claim(claimant, now_);
  EXPECT_TRUE(claimed.ok() && claimed->has_value());
  return claimed.ok() && claimed->has_value() ? **claimed : ClaimedJob();
}

bool JobStoreLaws::NothingToClaim(const Claimant& claimant) {
  const auto claimed = store_->Claim(claimant, now_);
  EXPECT_TRUE(claimed.ok()) << claimed.status();
  return claimed.ok() && !claimed->has_value();
}

std::string JobStoreLaws::RunNext(absl::Duration span) {
  const ClaimedJob claimed = Claim();
  now_ += span;
  EXPECT_TRUE(store_->Finish(claimed.id, claimed.epoch, Outcome(Job::FAILED), now_).ok());
  return claimed.job.tenant();
}

bool JobStoreLaws::IsUsed(const std::string& sha256) {
  bool is_hidden = false;
  const auto unused = store_->CollectBlob(sha256, [&] { is_hidden = true; });
  EXPECT_TRUE(unused.ok()) << unused.status();
  EXPECT_EQ(is_hidden, *unused);
  return !is_hidden;
}

Job::State JobStoreLaws::StateOf(const std::string& id) {
  const auto job = store_->Get(id);
  return job.ok() ? job->state() : Job::STATE_UNSPECIFIED;
}

}  // namespace amhex::server
