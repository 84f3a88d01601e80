// Slices of passes that are lent come back once, whatever becomes of their workers, and what nobody
// was asked for is refused and changes nothing.
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gtest/gtest.h"

#include "render/estimate/rounds.h"
#include "render/estimate/slice_sums.h"
#include "render/wire/block_codec.h"
#include "render/wire/messages.h"
#include "render/wire/slice_codec.h"
#include "tests/service/service_under_test.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kPhotons = 1000;  // of RequestFor, a pass

PassRange PassesOf(const v1::Lease& lease) {
  return {lease.first(), lease.last()};
}

class SlicesTest : public testing::Test {
 protected:
  SlicesTest() : client_(service_), scene_(client_.Upload(SmallScene())) {}

  std::string Submit(std::int64_t passes) {
    return client_.Submit(RequestFor(scene_, absl::StrCat("job ", ++requests_), passes))
        .message.job_id();
  }

  // Commits what it is lent until that is of a round that begins at `pass` or later.
  std::optional<v1::Lease> TakeSliceFrom(IdleHandsWorker& worker, std::uint64_t pass) {
    while (std::optional<v1::Lease> lease = worker.TakeLease()) {
      if (lease->pass() >= pass) return lease;
      const auto committed = worker.Commit(*lease);
      EXPECT_TRUE(committed.ok()) << committed.status.error_message();
    }
    return std::nullopt;
  }

  v1::CommitOutcome Outcome(IdleHandsWorker& worker, const v1::Lease& lease) {
    const auto committed = worker.Commit(lease);
    EXPECT_TRUE(committed.ok()) << committed.status.error_message();
    return committed.message.outcome();
  }

  std::uint64_t PhotonsOf(const std::string& job) {
    return client_.Get(job).message.progress().photons();
  }

  ServiceUnderTest service_;
  TestClient client_;
  v1::SceneManifest scene_;
  int requests_ = 0;
};

TEST_F(SlicesTest, AJobIsLentAsASplitPassAndThenInSlicesOfItsRounds) {
  IdleHandsWorker worker(service_);
  // Among several workers the first pass is split.
  const IdleHandsWorker other(service_, "other");
  const std::string job = Submit(41);
  std::set<std::uint64_t> passes;
  while (client_.Get(job).message.state() < v1::JOB_STATE_SUCCEEDED) {
    const auto answer = worker.Sync(true, Duration::zero());
    ASSERT_TRUE(answer.ok());
    if (!answer.message.has_lease()) continue;
    const v1::Lease& lease = answer.message.lease();
    EXPECT_EQ(lease.job_id(), job);
    EXPECT_EQ(lease.photons_per_pass(), kPhotons);
    if (lease.pass() == 0) {
      EXPECT_EQ(lease.kind(), v1::WORK_KIND_PHOTONS);
      EXPECT_EQ(lease.last(), kPhotons);
      EXPECT_TRUE(passes.insert(0).second);
    } else {
      ASSERT_EQ(lease.kind(), v1::WORK_KIND_PASSES);
      EXPECT_TRUE(IsSlice(PassesOf(lease))) << lease.first() << " " << lease.last();
      EXPECT_EQ(RoundOf(lease.first()).first, lease.pass());
      EXPECT_LE(lease.last(), 41U) << "no pass that is not wanted";
      EXPECT_GT(lease.caustic_radius(), 0);
      EXPECT_TRUE(lease.block_digest().empty());
      const auto radii = DecodeRadii(worker.Fetch(lease.radii_digest()).message, kSmallScenePixels);
      ASSERT_TRUE(radii.ok()) << radii.status();
      EXPECT_EQ(radii->size(), kSmallScenePixels);
      for (std::uint64_t pass = lease.first(); pass < lease.last(); ++pass)
        EXPECT_TRUE(passes.insert(pass).second) << pass;
    }
    EXPECT_EQ(Outcome(worker, lease), v1::COMMIT_OUTCOME_ACCEPTED);
  }
  EXPECT_EQ(passes.size(), 41U);
  EXPECT_EQ(*passes.rbegin(), 40U);
  const v1::Job ended = client_.Get(job).message;
  EXPECT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_EQ(ended.progress().photons(), 41 * kPhotons);
  EXPECT_EQ(ended.progress().passes(), 41);
}

TEST_F(SlicesTest, AJobIsDescribedAlsoAfterItsEndAndAnUnknownOneIsNot) {
  const std::string job = Submit(2);
  IdleHandsWorker worker(service_);
  EXPECT_EQ(worker.DescribeJob("unknown").code(), grpc::StatusCode::NOT_FOUND);
  const std::optional<v1::Lease> lease = worker.TakeLease();
  ASSERT_TRUE(lease);
  const auto described = worker.DescribeJob(lease->job_id());
  ASSERT_TRUE(described.ok()) << described.status.error_message();
  EXPECT_EQ(described.message.scene().SerializeAsString(), scene_.SerializeAsString());
  EXPECT_EQ(described.message.numeric_profile(), ServiceUnderTest::kNumericProfile);
  EXPECT_EQ(Outcome(worker, *lease), v1::COMMIT_OUTCOME_ACCEPTED);
  const WorkerThread diligent(service_);
  ASSERT_TRUE(client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).ok());
  EXPECT_TRUE(worker.DescribeJob(job).ok());
}

TEST_F(SlicesTest, ASliceCountsOnce) {
  const std::string job = Submit(100);
  IdleHandsWorker worker(service_);
  const auto slice = TakeSliceFrom(worker, 16);
  ASSERT_TRUE(slice);
  const std::uint64_t before = PhotonsOf(job);
  EXPECT_EQ(Outcome(worker, *slice), v1::COMMIT_OUTCOME_ACCEPTED);
  const v1::CommitOutcome second = Outcome(worker, *slice);
  EXPECT_TRUE(second == v1::COMMIT_OUTCOME_DUPLICATE || second == v1::COMMIT_OUTCOME_SUPERSEDED);
  EXPECT_EQ(PhotonsOf(job), before + kPhotons * PassesOf(*slice).size());
}

// The slice went to another worker meanwhile; the first to come counts.
TEST_F(SlicesTest, ASliceThatComesLateCountsWhenItIsTheFirst) {
  const std::string job = Submit(100);
  IdleHandsWorker late(service_);
  const auto lease = TakeSliceFrom(late, 16);
  ASSERT_TRUE(lease);
  const std::uint64_t before = PhotonsOf(job);
  service_.clock().Move(std::chrono::seconds(11));
  IdleHandsWorker other(service_);
  std::optional<v1::Lease> again = other.TakeLease();
  for (int i = 0; i < 1000 && again && again->first() != lease->first(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    again = other.TakeLease();
  }
  ASSERT_TRUE(again);
  ASSERT_EQ(PassesOf(*again), PassesOf(*lease)) << "the same slice, however many workers there are";
  const auto revoked = late.Sync(false, std::chrono::seconds(5), {lease->lease_id()});
  ASSERT_EQ(revoked.message.revoked_lease_ids_size(), 1);
  EXPECT_EQ(Outcome(late, *lease), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_NE(Outcome(other, *again), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(PhotonsOf(job), before + kPhotons * PassesOf(*lease).size());
}

TEST_F(SlicesTest, SlicesOfAConnectionThatBreaksGoBackWithoutAnyTimePassing) {
  Submit(100);
  IdleHandsWorker lost(service_);
  const auto lease = TakeSliceFrom(lost, 16);
  ASSERT_TRUE(lease);
  IdleHandsWorker other(service_);
  std::optional<v1::Lease> found;
  for (int i = 0; i < 20 && !found; ++i) {
    grpc::ClientContext context;
    std::thread heartbeat([&] {
      const auto answer = lost.Sync(false, std::chrono::seconds(5), {lease->lease_id()}, &context);
      EXPECT_EQ(answer.code(), grpc::StatusCode::CANCELLED);
    });
    // Long enough for the call to arrive, else it is made again.
    std::this_thread::sleep_for(std::chrono::milliseconds(50 * (i + 1)));
    context.TryCancel();
    heartbeat.join();
    for (int tries = 0; tries < 100 && !found; ++tries) {
      const auto answer = other.Sync(true, Duration::zero());
      if (answer.message.has_lease() && answer.message.lease().first() == lease->first()) {
        found = answer.message.lease();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  ASSERT_TRUE(found);
  EXPECT_EQ(PassesOf(*found), PassesOf(*lease));
  EXPECT_EQ(Outcome(other, *found), v1::COMMIT_OUTCOME_ACCEPTED);
}

// What the header says must be what was lent; the lease is then as it was.
TEST_F(SlicesTest, ASliceThatWasNotLentIsRefusedAndChangesNothing) {
  const std::string job = Submit(100);
  IdleHandsWorker worker(service_);
  const auto lease = TakeSliceFrom(worker, 16);
  ASSERT_TRUE(lease);
  ASSERT_EQ(lease->first(), 16U);
  const std::uint64_t before = PhotonsOf(job);
  const std::string good = worker.ResultOf(*lease);
  const auto code_of = [&](const v1::Lease& forged) {
    const auto answer = worker.CommitBytes(forged, good);
    EXPECT_EQ(PhotonsOf(job), before);
    return answer.code();
  };
  for (const auto& [first, last] :
       std::vector<std::pair<std::uint64_t, std::uint64_t>>{{17, 19},
                                                            {16, 17},
                                                            {16, 19},
                                                            {16, 16},
                                                            {18, 16},
                                                            {20, 24},
                                                            {12, 16},
                                                            {16, 24},
                                                            {0, 1},
                                                            {16, ~std::uint64_t{0}}}) {
    v1::Lease forged = *lease;
    forged.set_first(first);
    forged.set_last(last);
    EXPECT_EQ(code_of(forged), grpc::StatusCode::FAILED_PRECONDITION) << first << " " << last;
  }
  v1::Lease of_no_kind = *lease;
  of_no_kind.set_kind(v1::WORK_KIND_UNSPECIFIED);
  EXPECT_EQ(code_of(of_no_kind), grpc::StatusCode::INVALID_ARGUMENT);
  v1::Lease elsewhere = *lease;
  elsewhere.set_kind(v1::WORK_KIND_PHOTONS);
  EXPECT_EQ(code_of(elsewhere), grpc::StatusCode::FAILED_PRECONDITION);
  for (const std::uint64_t pass : {8, 17}) {
    elsewhere = *lease;
    elsewhere.set_pass(pass);
    EXPECT_EQ(code_of(elsewhere), grpc::StatusCode::FAILED_PRECONDITION);
  }
  elsewhere = *lease;
  elsewhere.set_job_id("another job");
  EXPECT_EQ(code_of(elsewhere), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(worker.CommitBytes(*lease, good).message.outcome(), v1::COMMIT_OUTCOME_ACCEPTED);
}

// Bytes that are not the result of the lease end it as a failure; what was lent is lent again.
TEST_F(SlicesTest, BytesThatAreNotTheResultAreRefusedAndChangeNothing) {
  const std::string job = Submit(200);
  IdleHandsWorker worker(service_);
  using Forge = std::function<std::string(const v1::Lease&)>;
  const auto slice_of = [](const v1::Lease& lease, std::size_t pixels, std::size_t evidence) {
    SliceSums slice = EmptySlice(PassesOf(lease), pixels, evidence);
    SetEscaped(slice.tally, kPhotons * slice.passes.size());
    return slice;
  };
  const auto other_lease = [&](const std::function<void(v1::Lease&)>& change) -> Forge {
    return [&worker, change](v1::Lease lease) {
      change(lease);
      return worker.ResultOf(lease);
    };
  };
  const auto with_tally = [&](const std::function<void(BatchTally&)>& change) -> Forge {
    return [&, change](const v1::Lease& lease) {
      SliceSums slice = slice_of(lease, kSmallScenePixels, 0);
      change(slice.tally);
      return EncodeSlice(slice);
    };
  };
  const std::vector<std::pair<std::string, Forge>> forgeries = {
      {"fewer passes", other_lease([](v1::Lease& lease) { lease.set_last(lease.first() + 1); })},
      {"a photon more", other_lease([](v1::Lease& l) { l.set_photons_per_pass(kPhotons + 1); })},
      {"photons twice", other_lease([](v1::Lease& l) { l.set_photons_per_pass(2 * kPhotons); })},
      {"more pixels",
       [&](const v1::Lease& l) { return EncodeSlice(slice_of(l, kSmallScenePixels + 1, 0)); }},
      {"no pixels", [&](const v1::Lease& l) { return EncodeSlice(slice_of(l, 0, 0)); }},
      {"more columns",
       [&](const v1::Lease& l) { return EncodeSlice(slice_of(l, kSmallScenePixels, 2)); }},
      {"no slice", [](const v1::Lease&) { return "LSL3 and then nothing of sense"; }},
      {"no bytes", [](const v1::Lease&) { return ""; }},
      {"bytes behind it", [&](const v1::Lease& lease) { return worker.ResultOf(lease) + "more"; }},
      {"too many bytes", [](const v1::Lease&) { return std::string(1'000'000, 'x'); }},
      // The counters balance, and are not those of the scene's light.
      {"no energy", with_tally([](BatchTally& tally) { tally.energy = {}; })},
      {"energy twice", with_tally([](BatchTally& tally) {
         tally.energy.emitted *= 2;
         tally.energy.escaped *= 2;
       })},
      {"absurd energy", with_tally([](BatchTally& tally) {
         tally.energy.emitted = tally.energy.escaped = std::int64_t{1} << 62;
       })},
      {"photons of no light", with_tally([](BatchTally& tally) { tally.lights.clear(); })},
  };
  std::optional<v1::Lease> lease = TakeSliceFrom(worker, 16);
  std::uint64_t failed = 0;
  for (const auto& [what, forge] : forgeries) {
    ASSERT_TRUE(lease) << what;
    if (what == "fewer passes" && PassesOf(*lease).size() == 1) continue;
    const std::uint64_t before = PhotonsOf(job);
    EXPECT_EQ(worker.CommitBytes(*lease, forge(*lease)).code(), grpc::StatusCode::INVALID_ARGUMENT)
        << what;
    EXPECT_EQ(worker.Commit(*lease).code(), grpc::StatusCode::FAILED_PRECONDITION)
        << "the lease has ended";
    EXPECT_EQ(PhotonsOf(job), before);
    EXPECT_EQ(service_.coordinator().ListWorkers()[0].leases.failed, ++failed);
    const auto again = worker.TakeLease();
    ASSERT_TRUE(again);
    EXPECT_EQ(PassesOf(*again), PassesOf(*lease)) << "what was lent is lent again";
    EXPECT_EQ(Outcome(worker, *again), v1::COMMIT_OUTCOME_ACCEPTED);
    lease = worker.TakeLease();
  }
}

// A slice that overlaps one that has come would count passes twice.
TEST_F(SlicesTest, APartOfASliceIsNotWhatWasLent) {
  const std::string job = Submit(100);
  IdleHandsWorker worker(service_);
  const auto lease = TakeSliceFrom(worker, 16);
  ASSERT_TRUE(lease);
  const PassRange whole = PassesOf(*lease);
  ASSERT_GE(whole.size(), 2U);
  const auto commit = [&](const PassRange& passes) {
    v1::Lease of_part = *lease;
    of_part.set_first(passes.first);
    of_part.set_last(passes.last);
    return worker.Commit(of_part).message.outcome();
  };
  const std::uint64_t before = PhotonsOf(job);
  EXPECT_NE(commit({whole.first, whole.first + 1}), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_NE(commit({whole.last - 1, whole.last}), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(PhotonsOf(job), before);
  EXPECT_EQ(commit(whole), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_NE(commit({whole.first, whole.first + 1}), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_NE(commit(whole), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(PhotonsOf(job), before + whole.size() * kPhotons);
}

TEST_F(SlicesTest, ASliceThatIsGivenUpAgainAndAgainPausesItsJobAndSaysWhichPasses) {
  const std::string job = Submit(100);
  IdleHandsWorker worker(service_);
  std::optional<v1::Lease> lease = TakeSliceFrom(worker, 16);
  ASSERT_TRUE(lease);
  // It is cut down to a single pass.
  const std::string passes = absl::StrCat("passes ", lease->first(), " to ", lease->first() + 1);
  for (int i = 0; i < 1000 && client_.Get(job).message.state() != v1::JOB_STATE_PAUSED; ++i) {
    const auto answer = worker.Sync(true, Duration::zero());
    ASSERT_TRUE(answer.ok());
    if (answer.message.has_lease()) {
      ASSERT_TRUE(worker.GiveUp(answer.message.lease(), "on purpose").ok());
    }
  }
  const v1::Job paused = client_.Get(job).message;
  EXPECT_EQ(paused.state(), v1::JOB_STATE_PAUSED);
  EXPECT_NE(paused.condition().find(passes), std::string::npos) << paused.condition();
  EXPECT_NE(paused.condition().find("on purpose"), std::string::npos) << paused.condition();
}

// The passes that have come without a gap count, also those of a round that is not whole.
TEST_F(SlicesTest, AJobThatIsStoppedKeepsThePassesOfARoundThatIsNotWhole) {
  const std::string job = Submit(100);
  // So many that slices are single passes.
  std::vector<std::unique_ptr<IdleHandsWorker>> workers;
  for (int i = 0; i < 4; ++i)
    workers.push_back(std::make_unique<IdleHandsWorker>(service_));
  std::vector<v1::Lease> leases = {TakeSliceFrom(*workers[0], 16).value()};
  for (std::size_t i = 1; i < 3; ++i)
    leases.push_back(workers[i]->TakeLease().value());
  ASSERT_EQ(PassesOf(leases[0]), (PassRange{16, 17}));
  ASSERT_EQ(PassesOf(leases[2]), (PassRange{18, 19}));
  ASSERT_EQ(Outcome(*workers[0], leases[0]), v1::COMMIT_OUTCOME_ACCEPTED);
  // Beyond a gap.
  ASSERT_EQ(Outcome(*workers[2], leases[2]), v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_TRUE(client_.Stop(job).ok());
  const v1::Job stopped = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(stopped.progress().passes(), 17);
  EXPECT_TRUE(client_.Image(job).ok());
  // It goes on from there: the pass of the tail is not traced again.
  EXPECT_TRUE(client_.Extend(job, 40).ok());
  const WorkerThread diligent(service_);
  const v1::Job ended = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(ended.stop_reason(), v1::STOP_REASON_PASSES);
  EXPECT_EQ(ended.progress().passes(), 40);
  // The pass beyond the gap was traced for nothing.
  EXPECT_EQ(ended.progress().photons(), 41 * kPhotons);
}

// Three workers and more share the photons of the first passes, and whole passes later on.
TEST_F(SlicesTest, EarlyPassesAreSplitWhenThereAreManyWorkers) {
  std::vector<std::unique_ptr<IdleHandsWorker>> workers;
  for (int i = 0; i < 3; ++i)
    workers.push_back(std::make_unique<IdleHandsWorker>(service_));
  const std::string job = Submit(40);
  std::map<std::uint64_t, v1::WorkKind> kinds;  // by round
  for (std::size_t i = 0; client_.Get(job).message.state() < v1::JOB_STATE_SUCCEEDED; ++i) {
    const auto answer = workers[i % workers.size()]->Sync(true, Duration::zero());
    ASSERT_TRUE(answer.ok());
    if (!answer.message.has_lease()) continue;
    const v1::Lease& lease = answer.message.lease();
    const auto [found, is_new] = kinds.emplace(lease.pass(), lease.kind());
    EXPECT_EQ(found->second, lease.kind());
    EXPECT_EQ(Outcome(*workers[i % workers.size()], lease), v1::COMMIT_OUTCOME_ACCEPTED);
  }
  EXPECT_EQ(client_.Get(job).message.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(kinds[0], v1::WORK_KIND_PHOTONS);
  // Of pass 1, two passes can be out at once, of pass 16 four.
  EXPECT_EQ(kinds[1], v1::WORK_KIND_PHOTONS);
  EXPECT_EQ(kinds[16], v1::WORK_KIND_PASSES);
  EXPECT_EQ(PhotonsOf(job), 40 * kPhotons);
}

// A worker that sends a whole pass where photons were asked for must not take the pass away from
// under those who have its photons.
TEST_F(SlicesTest, ASliceOfAPassThatIsSplitIsRefused) {
  IdleHandsWorker worker(service_);
  // Among several workers the first pass is split.
  const IdleHandsWorker other(service_, "other");
  const std::string job = Submit(3);
  std::optional<v1::Lease> lease = worker.TakeLease();
  while (lease && lease->pass() > 0)
    lease = worker.TakeLease();
  ASSERT_TRUE(lease);
  ASSERT_EQ(lease->kind(), v1::WORK_KIND_PHOTONS);
  v1::Lease forged = *lease;
  forged.set_kind(v1::WORK_KIND_PASSES);
  forged.set_first(0);
  forged.set_last(1);
  SliceSums slice = EmptySlice({0, 1}, kSmallScenePixels, 0);
  slice.tally.photons = kPhotons;
  EXPECT_NE(worker.CommitBytes(forged, EncodeSlice(slice)).message.outcome(),
            v1::COMMIT_OUTCOME_ACCEPTED);
  EXPECT_EQ(PhotonsOf(job), 0U);
  EXPECT_EQ(Outcome(worker, *lease), v1::COMMIT_OUTCOME_ACCEPTED);
  const WorkerThread diligent(service_);
  EXPECT_EQ(client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message.progress().photons(),
            3 * kPhotons);
}

// A slice is still with its worker when its job ends. More workers come, the job goes on, and its
// first round is split among them; then the slice comes after all.
TEST_F(SlicesTest, ASliceOfARunThatIsOverIsHarmlessToTheNextRun) {
  const std::string job = Submit(100);
  IdleHandsWorker slow(service_);
  const auto late = TakeSliceFrom(slow, 8);
  ASSERT_TRUE(late);
  ASSERT_EQ(late->first(), 8U);
  EXPECT_TRUE(client_.Stop(job).ok());
  ASSERT_TRUE(client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).ok());
  std::vector<std::unique_ptr<IdleHandsWorker>> more;
  for (int i = 0; i < 6; ++i)
    more.push_back(std::make_unique<IdleHandsWorker>(service_));
  EXPECT_TRUE(client_.Extend(job, 30).ok());
  // Passes before it may have come and not been taken in when the job was stopped.
  const std::optional<v1::Lease> photons = TakeSliceFrom(*more[0], 8);
  ASSERT_TRUE(photons);
  ASSERT_EQ(photons->kind(), v1::WORK_KIND_PHOTONS);
  const auto committed = slow.Commit(*late);
  EXPECT_TRUE(committed.ok() || committed.code() == grpc::StatusCode::INVALID_ARGUMENT)
      << committed.status.error_message();
  EXPECT_TRUE(more[0]->Commit(*photons).ok());
  const WorkerThread diligent(service_);
  const v1::Job ended = client_.WaitFor(job, {v1::JOB_STATE_SUCCEEDED}).message;
  EXPECT_EQ(ended.state(), v1::JOB_STATE_SUCCEEDED) << ended.failure();
  EXPECT_TRUE(client_.Image(job).ok());
}

}  // namespace
}  // namespace lucerna
