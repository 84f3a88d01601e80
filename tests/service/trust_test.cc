// The coordinator believes a worker what it can check, and takes out what turns out to be wrong.
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

#include "render/base/digest.h"
#include "render/estimate/slice_sums.h"
#include "render/image/exr_file.h"
#include "render/wire/slice_codec.h"
#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

class TrustTest : public testing::Test {
 protected:
  explicit TrustTest(double audit_share = 0) : service_({.audit_share = audit_share}) {
    scene_ = client_.Upload(SmallScene());
  }

  std::string Submit(std::int64_t passes) {
    return client_.Submit(RequestFor(scene_, absl::StrCat("job ", ++requests_), passes))
        .message.job_id();
  }
  // Commits what it is lent until that is of a round that begins at `pass` or later.
  std::optional<v1::Lease> TakeLeaseFrom(IdleHandsWorker& worker, std::uint64_t pass) {
    while (std::optional<v1::Lease> lease = worker.TakeLease()) {
      if (lease->pass() >= pass) return lease;
      EXPECT_TRUE(worker.Commit(*lease).ok());
    }
    return std::nullopt;
  }
  WorkerRecord RecordOf(const std::string& identity) {
    for (const WorkerRecord& record : service_.coordinator().ListWorkers()) {
      if (record.id == WorkerIdOf(identity)) return record;
    }
    ADD_FAILURE() << "no worker " << identity;
    return {};
  }
  Digest PixelsOf(const std::string& job) {
    const auto image = DecodeExr(client_.Image(job).message);
    EXPECT_TRUE(image.ok()) << image.status();
    return image.ok() ? image->PixelDigest() : Digest();
  }
  // Of a job without wrong results. With two workers the coordinator traces the first pass's eye
  // paths, which idle hands do not.
  Digest QuietPixels(std::int64_t passes) {
    const ServiceUnderTest quiet;
    TestClient client(quiet);
    const WorkerThread worker(quiet);
    const WorkerThread other(quiet);
    const std::string job =
        client.Submit(RequestFor(client.Upload(SmallScene()), "quiet", passes)).message.job_id();
    EXPECT_EQ(client.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message.state(),
              v1::JOB_STATE_SUCCEEDED);
    const auto image = DecodeExr(client.Image(job).message);
    return image.ok() ? image->PixelDigest() : Digest();
  }
  // What the worker should return, but for one pixel; the counters are right.
  static std::string Lie(IdleHandsWorker& worker, const v1::Lease& lease) {
    if (lease.kind() != v1::WORK_KIND_PASSES) return worker.ResultOf(lease);
    SliceSums slice = EmptySlice({lease.first(), lease.last()}, kSmallScenePixels, 0);
    SetEscaped(slice.tally, lease.photons_per_pass() * slice.passes.size());
    slice.columns[kPhotonRadiance].Set(0, 1);
    return EncodeSlice(slice);
  }

  ServiceUnderTest service_;
  TestClient client_{service_};
  v1::SceneManifest scene_;
  int requests_ = 0;
};

class AuditedTest : public TrustTest {
 protected:
  AuditedTest() : TrustTest(1) {}
};

TEST_F(TrustTest, OnlyTheHolderOfALeaseCommitsAndIsNotBlamedForOthers) {
  const std::string job = Submit(100);
  IdleHandsWorker holder(service_, "holder");
  IdleHandsWorker thief(service_, "thief");
  const auto lease = TakeLeaseFrom(holder, 0);
  ASSERT_TRUE(lease);
  const std::string right = holder.ResultOf(*lease);
  EXPECT_EQ(thief.CommitBytes(*lease, right).code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(thief.CommitBytes(*lease, "garbage").code(), grpc::StatusCode::PERMISSION_DENIED);
  v1::Lease guessed = *lease;
  guessed.set_lease_id(std::string(32, '0'));
  EXPECT_EQ(thief.CommitBytes(guessed, right).code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(holder.CommitBytes(guessed, right).code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(client_.Get(job).message.progress().photons(), 0U);
  EXPECT_EQ(RecordOf("holder").leases, LeaseCounts());
  EXPECT_EQ(RecordOf("holder").held, 1U);
  EXPECT_EQ(holder.CommitBytes(*lease, right).message.outcome(), v1::COMMIT_OUTCOME_ACCEPTED);
}

TEST_F(TrustTest, BytesThatBreakOffOnTheWayMaySentAgain) {
  Submit(100);
  IdleHandsWorker worker(service_, "worker");
  const auto lease = TakeLeaseFrom(worker, 0);
  ASSERT_TRUE(lease);
  const std::string right = worker.ResultOf(*lease);
  const auto stub = v1::WorkerService::NewStub(service_.NewChannel());
  grpc::ClientContext context;
  v1::CommitBatchResponse response;
  const auto writer = stub->CommitBatch(&context, &response);
  v1::CommitBatchRequest part;
  v1::CommitBatchRequest::Header& header = *part.mutable_header();
  header.set_worker_id(worker.id());
  header.set_lease_id(lease->lease_id());
  header.set_job_id(lease->job_id());
  header.set_kind(lease->kind());
  header.set_pass(lease->pass());
  header.set_first(lease->first());
  header.set_last(lease->last());
  header.set_digest(std::string(Sha256(right).Bytes()));
  header.set_size_bytes(right.size());
  writer->Write(part);
  part.set_bytes(right.substr(0, right.size() / 2));
  writer->Write(part);
  writer->WritesDone();
  EXPECT_FALSE(writer->Finish().ok());
  EXPECT_EQ(RecordOf("worker").leases, LeaseCounts());
  EXPECT_EQ(worker.CommitBytes(*lease, right).message.outcome(), v1::COMMIT_OUTCOME_ACCEPTED);
}

TEST_F(TrustTest, ALinkThatFlapsFailsNoJob) {
  const std::string job = Submit(3);
  for (int i = 0; i < 10; ++i) {
    IdleHandsWorker flapping(service_, "flapping");
    ASSERT_TRUE(flapping.TakeLease());
  }
  EXPECT_EQ(RecordOf("flapping").leases, (LeaseCounts{.lost = 9}));
  EXPECT_EQ(service_.coordinator().ListWorkers().size(), 1U);
  const WorkerThread diligent(service_);
  service_.clock().Move(std::chrono::seconds(11));
  EXPECT_EQ(client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message.state(),
            v1::JOB_STATE_SUCCEEDED);
}

// It renews its lease for ever and never asks for work.
TEST_F(TrustTest, AWorkerThatOnlyReportsHoldsUpNothing) {
  const std::string job = Submit(12);
  IdleHandsWorker hanging(service_, "hanging");
  const auto lease = TakeLeaseFrom(hanging, 1);
  ASSERT_TRUE(lease);
  const WorkerThread diligent(service_);
  bool is_revoked = false;
  for (int i = 0; i < 1000 && !is_revoked; ++i) {
    // Slowly enough for the other worker to be heard of.
    service_.clock().Move(std::chrono::milliseconds(250));
    const auto answer = hanging.Sync(false, Duration::zero(), {lease->lease_id()});
    ASSERT_TRUE(answer.ok()) << answer.status.error_message();
    is_revoked = answer.message.revoked_lease_ids_size() > 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_TRUE(is_revoked);
  EXPECT_EQ(client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message.state(),
            v1::JOB_STATE_SUCCEEDED);
}

TEST_F(TrustTest, AWorkerThatIsDrainedOrInQuarantineIsLentNothingUntilItIsReleased) {
  Submit(1000);
  IdleHandsWorker worker(service_, "worker");
  const auto admin = v1::AdminService::NewStub(service_.NewChannel());
  const auto order = [&](auto call, const std::string& id) {
    grpc::ClientContext context;
    v1::WorkerRequest request;
    request.set_worker_id(id);
    Answer<v1::Worker> answer;
    answer.status = (admin.get()->*call)(&context, request, &answer.message);
    return answer;
  };
  const auto is_lent = [&] { return worker.Sync(true, Duration::zero()).message.has_lease(); };
  const std::string id = WorkerIdOf("worker");
  const auto lease = TakeLeaseFrom(worker, 1);
  ASSERT_TRUE(lease);
  EXPECT_EQ(order(&v1::AdminService::Stub::DrainWorker, "unknown").code(),
            grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(order(&v1::AdminService::Stub::DrainWorker, id).message.state(),
            v1::WORKER_STATE_DRAINING);
  EXPECT_EQ(worker.Commit(*lease).message.outcome(), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_FALSE(is_lent());
  grpc::ClientContext context;
  v1::ListWorkersResponse list;
  ASSERT_TRUE(admin->ListWorkers(&context, {}, &list).ok());
  ASSERT_EQ(list.workers_size(), 1);
  EXPECT_EQ(list.workers(0).state(), v1::WORKER_STATE_DRAINED);
  EXPECT_EQ(list.workers(0).worker_id(), id);
  EXPECT_EQ(list.workers(0).name(), "idle hands");
  EXPECT_TRUE(list.workers(0).is_connected());
  EXPECT_GE(list.workers(0).committed(), 2U);
  order(&v1::AdminService::Stub::ReleaseWorker, id);
  EXPECT_TRUE(worker.TakeLease());
  EXPECT_EQ(order(&v1::AdminService::Stub::QuarantineWorker, id).message.reason(),
            "by an operator");
  EXPECT_FALSE(is_lent());
  EXPECT_EQ(order(&v1::AdminService::Stub::ReleaseWorker, id).message.state(),
            v1::WORKER_STATE_ACTIVE);
  EXPECT_TRUE(worker.TakeLease());
}

TEST_F(AuditedTest, WithTwoWorkersEveryBatchIsComparedAndThePhotonsCountOnce) {
  const WorkerThread first(service_);
  const WorkerThread second(service_);
  const std::string job = Submit(20);
  const v1::Job ended = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(ended.progress().photons(), 20'000U);
  EXPECT_GT(ended.progress().audits_agreed(), 0U);
  EXPECT_EQ(ended.progress().audits_disputed(), 0U);
  EXPECT_EQ(PixelsOf(job), QuietPixels(20));
}

// While it is alone nobody can contradict it, and its work is merged. Then two others come, and all
// that it brought is taken out of the image.
TEST_F(AuditedTest, AllWorkOfALiarIsTakenOut) {
  const std::string job = Submit(60);
  std::optional<v1::Lease> last_lie;
  IdleHandsWorker liar(service_, "liar");
  while (const auto lease = liar.TakeLease()) {
    if (lease->pass() >= 16) {
      last_lie = lease;
      break;
    }
    ASSERT_EQ(liar.CommitBytes(*lease, Lie(liar, *lease)).message.outcome(),
              v1::COMMIT_OUTCOME_ACCEPTED);
  }
  ASSERT_TRUE(last_lie);
  const v1::Progress before = client_.Get(job).message.progress();
  EXPECT_GT(before.photons(), 10'000U);
  EXPECT_GT(before.not_audited(), 0U);
  const WorkerThread second(service_);
  const WorkerThread third(service_);
  // Both are there before the lie is told.
  while (service_.coordinator().ListWorkers().size() < 3)
    std::this_thread::yield();
  EXPECT_EQ(liar.CommitBytes(*last_lie, Lie(liar, *last_lie)).message.outcome(),
            v1::COMMIT_OUTCOME_ACCEPTED);
  const v1::Job ended = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(RecordOf("liar").state, WorkerState::kQuarantined);
  EXPECT_FALSE(liar.Sync(true, Duration::zero()).message.has_lease());
  EXPECT_EQ(ended.progress().passes(), 60);
  EXPECT_EQ(ended.progress().tally().photons(), 60'000U) << "each photon once";
  for (const v1::WorkerShare& share : ended.worker_shares())
    EXPECT_NE(share.worker_id(), WorkerIdOf("liar"));
  EXPECT_EQ(PixelsOf(job), QuietPixels(60));
}

TEST_F(AuditedTest, AJobInWhichTwoWorkersDisagreeWaitsForAThird) {
  const std::string job = Submit(60);
  IdleHandsWorker liar(service_, "liar");
  const auto lie = TakeLeaseFrom(liar, 1);
  ASSERT_TRUE(lie);
  const WorkerThread second(service_);
  while (service_.coordinator().ListWorkers().size() < 2)
    std::this_thread::yield();
  ASSERT_TRUE(liar.CommitBytes(*lie, Lie(liar, *lie)).ok());
  const v1::Job paused = client_.WaitFor(job, {v1::JOB_STATE_PAUSED}).message;
  EXPECT_EQ(paused.pause_cause(), v1::PAUSE_CAUSE_DISPUTE);
  EXPECT_NE(paused.condition().find("different results"), std::string::npos) << paused.condition();
  const WorkerThread third(service_);
  const v1::Job ended = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  ASSERT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(ended.pause_cause(), v1::PAUSE_CAUSE_UNSPECIFIED);
  EXPECT_EQ(PixelsOf(job), QuietPixels(60));
}

TEST_F(AuditedTest, AnImageThatIsDoneSaysThatALiarHasAPartInIt) {
  const std::string done = Submit(4);
  IdleHandsWorker liar(service_, "liar");
  while (client_.Get(done).message.state() < v1::JOB_STATE_SUCCEEDED) {
    const auto answer = liar.Sync(true, Duration::zero());
    if (!answer.message.has_lease()) continue;
    ASSERT_TRUE(liar.CommitBytes(answer.message.lease(), Lie(liar, answer.message.lease())).ok());
  }
  Submit(60);
  const auto lie = TakeLeaseFrom(liar, 1);
  ASSERT_TRUE(lie);
  const WorkerThread second(service_);
  const WorkerThread third(service_);
  while (service_.coordinator().ListWorkers().size() < 3)
    std::this_thread::yield();
  EXPECT_TRUE(liar.CommitBytes(*lie, Lie(liar, *lie)).ok());
  while (RecordOf("liar").state != WorkerState::kQuarantined)
    std::this_thread::yield();
  v1::Job job;
  for (int i = 0; i < 1000 && job.events().empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    job = client_.Get(done).message;
  }
  ASSERT_FALSE(job.events().empty());
  EXPECT_NE(job.events(0).what().find("submit it again"), std::string::npos);
  EXPECT_EQ(client_.Extend(done, 10).code(), grpc::StatusCode::FAILED_PRECONDITION);
}

}  // namespace
}  // namespace lucerna
