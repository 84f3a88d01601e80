// How many workers does one coordinator serve, and what ends it?
//
// A discrete-event simulation of a farm under a virtual clock. What decides is the real code:
// Scheduler, ParkedSyncs, PassMerger, RoundMerger (with passes of one hitpoint and slices of one
// pixel) and the rules of rounds. What takes time is simulated from costs that were measured: the
// cores of workers and of the coordinator, its serial thread of the job, its pool for commits, and
// links with speed and latency. Calls of the scheduler are timed with the real clock meanwhile.
//
// Simplifications: a link carries one message after the other at full speed and never loses one;
// the pool for commits takes any number of them; scenes are there when the job begins; photons find
// hitpoints evenly.
//
// Run: build/release/bin/lucerna-farm-simulation [--OPTION VALUE]...
// One line of CSV for each number of workers. Options and their defaults: --help.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/base/clock.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/error_estimate.h"
#include "render/estimate/rounds.h"
#include "render/estimate/slice_sums.h"
#include "server/parked_syncs.h"
#include "server/pass_merger.h"
#include "server/round_merger.h"
#include "server/scheduler.h"
#include "tests/support/steady_time.h"

namespace lucerna {
namespace {

// All numbers, so that one table reads and prints them.
struct Costs {
  double width = 1920, height = 1080;
  double cores = 16;  // of a worker
  double coordinator_cores = 16;
  double seconds = 300;           // of the job
  double photons_per_pixel = 4;   // and pass
  double eye_ns = 900;            // of a core: an eye path with direct light
  double photon_ns = 1250;        // of a core: a photon path with gathering
  double encode_slice_ns = 150;   // of a core of a worker, a pixel and slice
  double add_pass_ns = 13;        // the same, a pixel and pass but the first of a slice
  double merge_ns = 105;          // a pixel and slice: decode and merge
  double statistics_ns = 50;      // a pixel and round, in parallel: statistics and radii
  double estimate_ns = 5;         // a pixel and estimate, on the job's thread
  double encode_block_ns = 10;    // a pixel and split pass, on the job's thread
  double encode_radii_ns = 4;     // a pixel and round, or split pass, on the job's thread
  double accumulation_ns = 75;    // a hitpoint that a batch of photons touched: decode and add
  double split_slice_ns = 60;     // a pixel and split pass, in parallel: its slice
  double rpc_us = 50;             // of a core of the coordinator, any call
  double slice_bytes = 21;        // a pixel
  double first_slice_bytes = 24;  // a pixel, in the first 16 passes
  double radii_bytes = 2;         // a pixel, round and worker
  double block_bytes = 8;         // a pixel and worker, of a split pass
  double accumulation_bytes = 8;  // a hitpoint that a batch of photons touched
  double found_photons = 40;      // that a hitpoint finds in a pass
  double worker_gbit = 10;        // [Gbit/s] each way
  double coordinator_gbit = 10;   // [Gbit/s] each way
  double latency_ms = 0.2;        // one way
  double slow_share = 0;          // of workers, at half speed
  double stall_every = 0;         // [s] a worker's mean time between stalls; 0: never
  double stall_seconds = 30;      // a worker does nothing and says nothing
  double stay_seconds = 0;        // a worker's mean stay, then it leaves or is killed; 0: for ever
  double away_seconds = 10;       // until it is there again
  double max_slice = 16;          // [passes] SchedulerOptions::max_slice
  double slices_per_worker = 2;   // SchedulerOptions::slices_per_worker
  // Of a slice of one pass, a pixel; 0: as of other slices.
  double single_slice_bytes = 12.5;
  // Rounds from this pass on are never split, whatever the policy says.
  double split_below = 16;
  double split_ways = 6;      // SchedulerOptions::max_split_ways
  double split_passes = 2;    // are out at once at most
  double progress_every = 0;  // [s] lines to stderr; 0: none
  double seed = 1;
};

struct Option {
  const char* name;
  double Costs::*value;
  const char* unit;
};
constexpr std::array kOptions = {
    Option{"width", &Costs::width, "pixels"},
    Option{"height", &Costs::height, "pixels"},
    Option{"cores", &Costs::cores, "of a worker"},
    Option{"coordinator-cores", &Costs::coordinator_cores, ""},
    Option{"seconds", &Costs::seconds, "s, of the job"},
    Option{"photons-per-pixel", &Costs::photons_per_pixel, "and pass"},
    Option{"eye", &Costs::eye_ns, "ns of a core, an eye path"},
    Option{"photon", &Costs::photon_ns, "ns of a core, a photon path with gathering"},
    Option{"encode-slice", &Costs::encode_slice_ns, "ns of a worker's core, a pixel and slice"},
    Option{"add-pass", &Costs::add_pass_ns, "ns of a worker's core, a pixel and pass but one"},
    Option{"merge", &Costs::merge_ns, "ns a pixel and slice"},
    Option{"statistics", &Costs::statistics_ns, "ns a pixel and round, parallel"},
    Option{"estimate", &Costs::estimate_ns, "ns a pixel and estimate, serial"},
    Option{"encode-block", &Costs::encode_block_ns, "ns a pixel and split pass, serial"},
    Option{"encode-radii", &Costs::encode_radii_ns, "ns a pixel and round or split pass, serial"},
    Option{"accumulation", &Costs::accumulation_ns, "ns a hitpoint touched by a batch"},
    Option{"split-slice", &Costs::split_slice_ns, "ns a pixel and split pass, parallel"},
    Option{"rpc", &Costs::rpc_us, "us of a core of the coordinator, a call"},
    Option{"slice-bytes", &Costs::slice_bytes, "bytes a pixel and slice"},
    Option{"first-slice-bytes", &Costs::first_slice_bytes, "the same, first 16 passes"},
    Option{"radii-bytes", &Costs::radii_bytes, "bytes a pixel, round and worker"},
    Option{"block-bytes", &Costs::block_bytes, "bytes a pixel, split pass and worker"},
    Option{"accumulation-bytes", &Costs::accumulation_bytes, "bytes a hitpoint touched"},
    Option{"found-photons", &Costs::found_photons, "that a hitpoint finds in a pass"},
    Option{"worker-gbit", &Costs::worker_gbit, "Gbit/s each way"},
    Option{"coordinator-gbit", &Costs::coordinator_gbit, "Gbit/s each way"},
    Option{"latency", &Costs::latency_ms, "ms one way"},
    Option{"slow-share", &Costs::slow_share, "of workers, at half speed"},
    Option{"stall-every", &Costs::stall_every, "s, mean, a worker; 0: never"},
    Option{"stall-seconds", &Costs::stall_seconds, "s"},
    Option{"stay", &Costs::stay_seconds, "s, mean, a worker; 0: for ever"},
    Option{"away", &Costs::away_seconds, "s"},
    Option{"max-slice", &Costs::max_slice, "passes"},
    Option{"slices-per-worker", &Costs::slices_per_worker, ""},
    Option{"single-slice-bytes", &Costs::single_slice_bytes, "bytes a pixel; 0: as others"},
    Option{"split-below", &Costs::split_below, "first pass of rounds that are never split"},
    Option{"split-ways", &Costs::split_ways, "workers that share a split pass at most"},
    Option{"split-passes", &Costs::split_passes, "out at once"},
    Option{"progress-every", &Costs::progress_every, "s, lines to stderr; 0: none"},
    Option{"seed", &Costs::seed, ""},
};

constexpr double kTick = 0.05;    // [s] Coordinator::Tick
constexpr double kSyncEvery = 3;  // [s] a heartbeat waits so long

// What the real parts cost, by the real clock.
struct CallTimes {
  std::uint64_t calls = 0;
  Duration total{}, longest{};

  template <typename F>
  auto Time(F call) {
    const SteadyTime begin = SystemClock().Steady();
    auto result = call();
    const Duration took = SystemClock().Steady() - begin;
    ++calls;
    total += took;
    longest = std::max(longest, took);
    return result;
  }
};

class Farm {
 public:
  Farm(const Costs& costs, int workers) : c_(costs), random_(static_cast<unsigned>(costs.seed)) {
    SchedulerOptions options;
    options.max_slice = static_cast<std::uint64_t>(c_.max_slice);
    options.slices_per_worker = static_cast<std::uint64_t>(c_.slices_per_worker);
    options.max_split_ways = static_cast<std::uint64_t>(c_.split_ways);
    scheduler_ = std::make_unique<Scheduler>(options);
    workers_.resize(static_cast<std::size_t>(workers));
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(workers);
      // Spread evenly over the farm.
      const bool is_slow = std::fmod(share * 997.0, 1.0) < c_.slow_share;
      workers_[i].cores = c_.cores * (is_slow ? 0.5 : 1);
      Join(i);
    }
    Tick();
    StepJob();
    if (c_.progress_every > 0) ReportProgress();
  }

  void Run() {
    while (!events_.empty() && events_.top().time <= c_.seconds) {
      Event event = events_.top();
      events_.pop();
      now_ = event.time;
      event.action();
    }
    now_ = c_.seconds;
    for (Worker& worker : workers_) {
      if (worker.is_here) Capacity(worker);
    }
  }

  static void PrintHeader() {
    std::printf(
        "width,height,workers,cores each,efficiency %%,second half %%,passes,photons M/s,"
        "first image s,passes split,workers wait for work %%,coordinator cores,link in MB/s,"
        "link out MB/s,link in %%,link out %%,job's thread %%,commit pool %%,calls/s,"
        "scheduler ns/call,longest us,limit\n");
  }
  void Print() const {
    const double efficiency = useful_ / capacity_;
    const double in_use = in_.busy / c_.seconds;
    const double out_use = out_.busy / c_.seconds;
    const double job_use = job_busy_ / c_.seconds;
    const double pool_use = pool_busy_ / (c_.seconds * c_.coordinator_cores);
    const double waits = waiting_ / here_;
    const char* limit = "workers";
    const double most = std::max({in_use, out_use, job_use, pool_use});
    if (efficiency < 0.95) {
      limit = "passes out at once";
      if (most > 0.8) {
        limit = most == in_use    ? "link in"
                : most == out_use ? "link out"
                : most == job_use ? "job's thread"
                                  : "commit pool";
      }
    }
    std::printf(
        "%.0f,%.0f,%zu,%.0f,%.1f,%.1f,%llu,%.2f,%.3f,%llu,%.1f,%.2f,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f,"
        "%.0f,%.0f,%.0f,%s\n",
        c_.width, c_.height, workers_.size(), c_.cores, 100 * efficiency,
        100 * useful_late_ / capacity_late_, static_cast<unsigned long long>(PassesDone()),
        1e-6 * photons_ / c_.seconds, first_image_, static_cast<unsigned long long>(split_count_),
        100 * waits, coordinator_work_ / c_.seconds, 1e-6 * in_.bytes / c_.seconds,
        1e-6 * out_.bytes / c_.seconds, 100 * in_use, 100 * out_use, 100 * job_use, 100 * pool_use,
        static_cast<double>(rpcs_) / c_.seconds,
        1e9 * Seconds(times_.total) / static_cast<double>(std::max<std::uint64_t>(1, times_.calls)),
        1e6 * Seconds(times_.longest), limit);
    std::fflush(stdout);
  }

 private:
  struct Event {
    double time = 0;
    std::uint64_t order = 0;
    std::function<void()> action;
    bool operator<(const Event& other) const {
      return std::pair(time, order) > std::pair(other.time, other.order);
    }
  };
  struct Held {
    BatchLease lease;
    bool is_revoked = false;
  };
  using HeldPtr = std::shared_ptr<Held>;
  struct Link {
    double free_at = 0, busy = 0, bytes = 0;
  };
  // As worker/lease_runner.h: one lease is fetched ahead, one is computed, one result waits and one
  // is sent.
  struct Worker {
    std::string id;
    double cores = 0;
    bool is_here = false;
    int stay = 0;  // counts arrivals; events of an earlier stay are void
    double arrived_at = 0;
    double stalled_until = 0;
    std::map<std::string, HeldPtr> held;
    bool is_fetching = false, wants_since_valid = false;
    double wants_since = 0;
    HeldPtr fetched, computing, done, sending;
    bool is_blocked = false;  // computing is done, but `done` is taken
    int computation = 0;
    double computed_at = 0;
    std::optional<std::uint64_t> radii, block;  // that the worker has, by pass
    Link in, out;
    std::vector<std::uint64_t> tickets;
  };
  struct OpenRound {
    PassRange round;
    bool is_split = false;
  };

  [[nodiscard]] double Pixels() const { return c_.width * c_.height; }
  [[nodiscard]] std::uint64_t PhotonsPerPass() const {
    return static_cast<std::uint64_t>(Pixels() * c_.photons_per_pixel);
  }
  [[nodiscard]] double Latency() const { return 1e-3 * c_.latency_ms; }
  PassKey KeyOf(std::uint64_t pass) const { return {"job", pass}; }

  void After(double s, std::function<void()> action) {
    events_.push({now_ + s, next_event_++, std::move(action)});
  }
  // An event of a worker: void when it has left since, late when it is stalled.
  void AfterFor(std::size_t index, double s, std::function<void()> action) {
    const int stay = workers_[index].stay;
    After(s, [this, index, stay, action = std::move(action)] {
      const Worker& worker = workers_[index];
      if (worker.stay != stay || !worker.is_here) return;
      if (worker.stalled_until > now_) {
        AfterFor(index, worker.stalled_until - now_, action);
      } else {
        action();
      }
    });
  }
  double Exponential(double mean) {
    return std::exponential_distribution<double>(1 / mean)(random_);
  }

  // When `bytes` have gone over both links.
  double Transfer(Link& worker_link, Link& coordinator_link, double bytes) {
    const double by_worker = bytes * 8e-9 / c_.worker_gbit;
    const double by_coordinator = bytes * 8e-9 / c_.coordinator_gbit;
    const double begin =
        std::max({now_, coordinator_link.free_at, worker_link.free_at - by_coordinator});
    coordinator_link.free_at = begin + by_coordinator;
    coordinator_link.busy += by_coordinator;
    coordinator_link.bytes += bytes;
    worker_link.free_at = std::max(now_, worker_link.free_at) + by_worker;
    worker_link.bytes += bytes;
    return std::max(coordinator_link.free_at, worker_link.free_at) + Latency() - now_;
  }
  void ReportProgress() {
    std::fprintf(stderr, "%6.0f s: %8llu passes, link in %5.1f MB/s, out %5.1f MB/s\n", now_,
                 static_cast<unsigned long long>(PassesDone()),
                 1e-6 * (in_.bytes - reported_in_) / c_.progress_every,
                 1e-6 * (out_.bytes - reported_out_) / c_.progress_every);
    reported_in_ = in_.bytes;
    reported_out_ = out_.bytes;
    After(c_.progress_every, [this] { ReportProgress(); });
  }
  void CountCall() {
    ++rpcs_;
    coordinator_work_ += 1e-6 * c_.rpc_us;
  }

  // Workers -------------------------------------------------------------------------------------

  void Capacity(const Worker& worker) {
    capacity_ += worker.cores * (now_ - worker.arrived_at);
    capacity_late_ +=
        worker.cores * std::max(0.0, now_ - std::max(worker.arrived_at, c_.seconds / 2));
    here_ += now_ - worker.arrived_at;
  }

  void Join(std::size_t index) {
    Worker& worker = workers_[index];
    Worker fresh;
    fresh.cores = worker.cores;
    fresh.stay = worker.stay + 1;
    worker = std::move(fresh);
    worker.is_here = true;
    worker.arrived_at = now_;
    worker.id = scheduler_
                    ->AddWorker(absl::StrCat("host", index), At(now_), {}, {},
                                static_cast<int>(worker.cores))
                    .value();
    CountCall();
    AfterFor(index, 0, [this, index] { Fetch(index); });
    AfterFor(index, 0, [this, index] { Heartbeat(index); });
    if (c_.stay_seconds > 0) {
      AfterFor(index, Exponential(c_.stay_seconds), [this, index] { Leave(index); });
    }
    if (c_.stall_every > 0) {
      AfterFor(index, Exponential(c_.stall_every), [this, index] { Stall(index); });
    }
  }

  void Leave(std::size_t index) {
    Worker& worker = workers_[index];
    Capacity(worker);
    if (worker.wants_since_valid) waiting_ += now_ - worker.wants_since;
    worker.is_here = false;
    const bool is_killed = random_() % 2 == 0;
    for (const std::uint64_t ticket : worker.tickets)
      static_cast<void>(parked_.Break(ticket));
    if (is_killed) {
      scheduler_->LoseWorker(worker.id);
    } else {
      scheduler_->RemoveWorker(worker.id);
    }
    AnswerParked();
    After(c_.away_seconds, [this, index] { Join(index); });
  }

  void Stall(std::size_t index) {
    Worker& worker = workers_[index];
    worker.stalled_until = now_ + c_.stall_seconds;
    worker.computed_at += c_.stall_seconds;
    AfterFor(index, c_.stall_seconds + Exponential(c_.stall_every),
             [this, index] { Stall(index); });
  }

  Scheduler::Report ReportOf(const Worker& worker, bool wants_lease) const {
    Scheduler::Report report;
    for (const auto& [id, held] : worker.held)
      report.held.push_back(id);
    report.wants_lease = wants_lease;
    return report;
  }

  void Heartbeat(std::size_t index) { SendSync(index, /*wants_lease=*/false); }
  void Fetch(std::size_t index) {
    Worker& worker = workers_[index];
    if (worker.is_fetching || worker.fetched) return;
    worker.is_fetching = true;
    SendSync(index, /*wants_lease=*/true);
  }

  void SendSync(std::size_t index, bool wants_lease) {
    After(Latency(), [this, index, stay = workers_[index].stay, wants_lease,
                      report = ReportOf(workers_[index], wants_lease)] {
      if (workers_[index].stay == stay && workers_[index].is_here) {
        Sync(index, report, wants_lease);
      }
    });
  }

  void OnSync(std::size_t index, const SyncAnswer& answer, bool wants_lease) {
    Worker& worker = workers_[index];
    for (const std::string& id : answer.revoked) {
      const auto found = worker.held.find(id);
      if (found == worker.held.end()) continue;
      const HeldPtr held = found->second;
      worker.held.erase(found);
      held->is_revoked = true;
      if (worker.computing == held && !worker.is_blocked) {
        ++worker.computation;  // broken off
        worker.computing = nullptr;
        Compute(index);
      }
    }
    if (!wants_lease) {
      Heartbeat(index);
      return;
    }
    worker.is_fetching = false;
    if (!answer.loan) {
      Fetch(index);
      return;
    }
    worker.is_fetching = true;
    const auto held = std::make_shared<Held>(Held{answer.loan->lease});
    worker.held[held->lease.id] = held;
    double bytes = 0;
    const std::uint64_t pass = held->lease.pass.pass;
    if (worker.radii != pass) {
      bytes += c_.radii_bytes * Pixels();
      worker.radii = pass;
      CountCall();
    }
    if (held->lease.kind == WorkKind::kPhotons && worker.block != pass) {
      bytes += c_.block_bytes * Pixels();
      worker.block = pass;
      CountCall();
    }
    const double took = bytes > 0 ? Latency() + Transfer(worker.in, out_, bytes) : 0;
    AfterFor(index, took, [this, index, held] {
      workers_[index].is_fetching = false;
      workers_[index].fetched = held;
      Compute(index);
    });
  }

  // Core seconds that the work of a lease takes.
  [[nodiscard]] double WorkOf(const BatchLease& lease) const {
    if (lease.kind == WorkKind::kPhotons) return PathWorkOf(lease);
    const auto size = static_cast<double>(lease.range.size());
    return PathWorkOf(lease) + 1e-9 * Pixels() * ((size - 1) * c_.add_pass_ns + c_.encode_slice_ns);
  }
  // Of those what paths take.
  [[nodiscard]] double PathWorkOf(const BatchLease& lease) const {
    const auto size = static_cast<double>(lease.range.size());
    if (lease.kind == WorkKind::kPhotons) return 1e-9 * c_.photon_ns * size;
    return 1e-9 * size * Pixels() * (c_.eye_ns + c_.photon_ns * c_.photons_per_pixel);
  }
  // Rows that a batch of photons touches.
  [[nodiscard]] double RowsOf(const BatchLease& lease) const {
    const double share =
        static_cast<double>(lease.range.size()) / static_cast<double>(PhotonsPerPass());
    return Pixels() * (1 - std::exp(-c_.found_photons * share));
  }
  [[nodiscard]] double BytesOf(const BatchLease& lease) const {
    if (lease.kind == WorkKind::kPhotons) return c_.accumulation_bytes * RowsOf(lease);
    if (lease.range.first < kFeaturePasses) return c_.first_slice_bytes * Pixels();
    const bool is_single = lease.range.size() == 1 && c_.single_slice_bytes > 0;
    return (is_single ? c_.single_slice_bytes : c_.slice_bytes) * Pixels();
  }

  void Compute(std::size_t index) {
    Worker& worker = workers_[index];
    if (worker.computing) return;
    while (worker.fetched && worker.fetched->is_revoked) {
      worker.fetched = nullptr;
      Fetch(index);
    }
    if (!worker.fetched) {
      if (!worker.wants_since_valid) worker.wants_since = now_;
      worker.wants_since_valid = true;
      Fetch(index);
      return;
    }
    if (worker.wants_since_valid) waiting_ += now_ - worker.wants_since;
    worker.wants_since_valid = false;
    worker.computing = std::exchange(worker.fetched, nullptr);
    Fetch(index);
    const double took = WorkOf(worker.computing->lease) / worker.cores;
    worker.computed_at = now_ + took;
    AfterCompute(index, ++worker.computation, took);
  }
  void AfterCompute(std::size_t index, int computation, double took) {
    AfterFor(index, took, [this, index, computation] {
      Worker& worker = workers_[index];
      if (worker.computation != computation) return;
      if (worker.computed_at > now_ + 1e-9) {
        AfterCompute(index, computation, worker.computed_at - now_);
        return;
      }
      worker.is_blocked = true;
      HandOver(index);
    });
  }
  void HandOver(std::size_t index) {
    Worker& worker = workers_[index];
    if (!worker.is_blocked || worker.done) return;
    worker.is_blocked = false;
    worker.done = std::exchange(worker.computing, nullptr);
    Send(index);
    Compute(index);
  }

  void Send(std::size_t index) {
    Worker& worker = workers_[index];
    if (worker.sending || !worker.done) return;
    worker.sending = std::exchange(worker.done, nullptr);
    HandOver(index);
    const HeldPtr held = worker.sending;
    const BatchLease& lease = held->lease;
    // The header goes first: bytes of a pass that has ended are not sent.
    const bool is_open = lease.kind == WorkKind::kPhotons
                             ? passes_.Hitpoints(lease.pass).has_value()
                             : rounds_.ShapeOf(lease.pass).has_value();
    if (held->is_revoked || !is_open) {
      AfterFor(index, held->is_revoked ? 0 : 2 * Latency(), [this, index] { Sent(index); });
      return;
    }
    const int stay = worker.stay;
    After(Transfer(worker.out, in_, BytesOf(lease)), [this, index, stay, held] {
      // Bytes of a worker that was killed do not arrive.
      if (workers_[index].stay != stay || !workers_[index].is_here) return;
      pool_.push_back({held, index, stay});
      RunPool();
    });
  }
  void Sent(std::size_t index) {
    Worker& worker = workers_[index];
    worker.held.erase(worker.sending->lease.id);
    worker.sending = nullptr;
    Send(index);
    HandOver(index);
  }

  // The coordinator ------------------------------------------------------------------------------

  std::optional<StatusOr<SyncAnswer>> TryAnswer(const std::string& worker,
                                                const Scheduler::Report& report) {
    StatusOr<Scheduler::Answer> result =
        times_.Time([&] { return scheduler_->AnswerFor(worker, report, At(now_)); });
    if (!result.ok()) return result.status();
    if (!result->lease && result->revoked.empty()) return std::nullopt;
    SyncAnswer answer;
    answer.revoked = std::move(result->revoked);
    if (result->lease) answer.loan = Loan{*std::move(result->lease), {}};
    return answer;
  }

  // As Coordinator::AnswerParked.
  void AnswerParked() {
    const auto try_answer = [this](const std::string& worker, const Scheduler::Report& report) {
      return TryAnswer(worker, report);
    };
    const auto on_broken = [](const ParkedSyncs::Call&) {};
    const std::vector<std::string> affected =
        times_.Time([&] { return scheduler_->TakeAffected(); });
    parked_.AnswerWorkers(affected, At(now_), try_answer, on_broken);
    while (const std::optional<std::string> worker =
               times_.Time([&] { return scheduler_->TakeWaiting(At(now_)); })) {
      parked_.AnswerWorkers({*worker}, At(now_), try_answer, on_broken);
    }
    parked_.AnswerOverdue(At(now_), try_answer, on_broken);
  }

  // As Coordinator::Sync.
  void Sync(std::size_t index, const Scheduler::Report& report, bool wants_lease) {
    CountCall();
    const std::string id = workers_[index].id;
    const int stay = workers_[index].stay;
    const auto answer = [this, index, stay, wants_lease](const StatusOr<SyncAnswer>& result) {
      if (!result.ok()) {
        // The coordinator has forgotten the worker, which joins again.
        AfterFor(index, Latency(), [this, index] {
          Capacity(workers_[index]);
          Join(index);
        });
        return;
      }
      if (workers_[index].stay != stay) return;
      AfterFor(index, Latency(), [this, index, wants_lease, result = *result] {
        OnSync(index, result, wants_lease);
      });
    };
    const Status heard = times_.Time([&] { return scheduler_->TakeReport(id, report, At(now_)); });
    if (!heard.ok()) {
      if (workers_[index].is_here) answer(heard);
      return;
    }
    if (wants_lease) AnswerParked();
    if (auto ready = TryAnswer(id, report)) {
      answer(*std::move(ready));
      return;
    }
    std::vector<std::uint64_t>& tickets = workers_[index].tickets;
    if (tickets.size() > 16) tickets.erase(tickets.begin(), tickets.end() - 2);
    tickets.push_back(parked_.Park({id, report, At(now_ + kSyncEvery), answer}));
  }

  void Tick() {
    times_.Time([&] {
      scheduler_->Expire(At(now_));
      return 0;
    });
    static_cast<void>(scheduler_->TakePoisoned());
    AnswerParked();
    After(kTick, [this] { Tick(); });
  }

  struct Commit {
    HeldPtr held;
    std::size_t worker = 0;
    int stay = 0;
  };
  void RunPool() {
    while (!pool_.empty() && pool_running_ < c_.coordinator_cores) {
      const Commit commit = pool_.front();
      pool_.pop_front();
      ++pool_running_;
      const BatchLease& lease = commit.held->lease;
      const double work = lease.kind == WorkKind::kPhotons
                              ? 1e-9 * c_.accumulation_ns * RowsOf(lease)
                              : 1e-9 * c_.merge_ns * Pixels();
      CountCall();
      coordinator_work_ += work;
      // While the job's thread works on all cores, the pool has its share of them.
      const double share =
          job_is_parallel_ ? c_.coordinator_cores / (c_.coordinator_cores + pool_running_) : 1;
      pool_busy_ += work / share;
      After(work / share, [this, commit] {
        --pool_running_;
        Merge(commit);
        RunPool();
      });
    }
  }

  void Merge(const Commit& commit) {
    const BatchLease& lease = commit.held->lease;
    StatusOr<MergeOutcome> outcome = MergeOutcome::kSuperseded;
    if (lease.kind == WorkKind::kPhotons) {
      Accumulation accumulation;
      accumulation.tally.photons = lease.range.size();
      outcome = passes_.Merge(lease.pass, lease.range, accumulation);
    } else {
      SliceSums slice = EmptySlice({lease.range.first, lease.range.last}, 1, 0);
      outcome = rounds_.Merge(lease.pass, std::move(slice));
    }
    if (!outcome.ok()) {
      std::fprintf(stderr, "%s\n", std::string(outcome.status().message()).c_str());
      std::abort();
    }
    if (*outcome == MergeOutcome::kAccepted) {
      times_.Time([&] {
        scheduler_->Commit(lease.pass, lease.range, At(now_));
        scheduler_->CountWork(workers_[commit.worker].id, lease.pass.job_id, lease.kind,
                              lease.range.size(), At(PathWorkOf(lease)) - At(0));
        return 0;
      });
      const double work = PathWorkOf(lease);
      useful_ += work;
      if (now_ > c_.seconds / 2) useful_late_ += work;
      photons_ += lease.kind == WorkKind::kPhotons ? static_cast<double>(lease.range.size())
                                                   : static_cast<double>(lease.range.size()) *
                                                         static_cast<double>(PhotonsPerPass());
      StepJob();
    }
    if (workers_[commit.worker].stay == commit.stay && workers_[commit.worker].is_here) {
      AfterFor(commit.worker, Latency(), [this, index = commit.worker] { Sent(index); });
    }
  }

  // The job's thread -----------------------------------------------------------------------------

  // A step of so many core seconds on one core and so many on all; then `end`.
  void Work(double serial, double parallel, std::function<void()> end) {
    const double cores = c_.coordinator_cores;
    const double took = serial + parallel * (cores + pool_running_) / (cores * cores);
    coordinator_work_ += serial + parallel;
    job_busy_ += took;
    job_is_busy_ = true;
    job_is_parallel_ = parallel > serial;
    After(took, [this, end = std::move(end)] {
      job_is_busy_ = false;
      job_is_parallel_ = false;
      end();
      StepJob();
    });
  }

  [[nodiscard]] std::uint64_t PassesDone() const {
    if (open_rounds_.empty()) return added_;
    return rounds_.PrefixEnd(KeyOf(open_rounds_.front().round.first)).value_or(added_);
  }

  [[nodiscard]] std::optional<std::uint64_t> NextToSplit() const {
    for (const OpenRound& open : open_rounds_) {
      if (open.is_split && open.round.last > next_split_) {
        return std::max(next_split_, open.round.first);
      }
    }
    return std::nullopt;
  }

  // The rules of JobRunner::Step and JobRunner::OpenNextRound, which depend on much else there and
  // are written down here a second time.
  void StepJob() {
    if (job_is_busy_) return;
    const PassRange round = RoundOf(next_round_);
    const auto most_open =
        std::max<std::uint64_t>(512, 64 * static_cast<std::uint64_t>(scheduler_->LiveWorkers()));
    if (added_ >= RadiiFrom(round) && next_round_ < added_ + most_open) {
      const std::uint64_t at_once = round.last - RadiiFrom(round);
      const bool is_split =
          round.first == 0 || (static_cast<double>(round.first) < c_.split_below &&
                               at_once < static_cast<std::uint64_t>(scheduler_->LiveWorkers()));
      next_round_ = round.last;
      Work(is_split ? 0 : 1e-9 * c_.encode_radii_ns * Pixels(), 0, [this, round, is_split] {
        rounds_.Open(
            KeyOf(round.first),
            {.passes = round, .pixels = 1, .evidence = 0, .photons_per_pass = PhotonsPerPass()});
        open_rounds_.push_back({round, is_split});
        if (is_split) return;
        scheduler_->OpenRound(KeyOf(round.first), {round.first, round.last}, At(c_.seconds));
        AnswerParked();
      });
      return;
    }
    const std::optional<std::uint64_t> to_split = NextToSplit();
    const double eye_work = 1e-9 * c_.eye_ns * Pixels();
    const double block_work = 1e-9 * c_.encode_block_ns * Pixels();
    if (to_split && static_cast<double>(split_passes_.size()) < c_.split_passes) {
      const std::uint64_t pass = *to_split;
      const bool is_ahead = ahead_ == pass;
      ahead_.reset();
      Work(1e-9 * c_.encode_radii_ns * Pixels() + (is_ahead ? 0 : block_work),
           is_ahead ? 0 : eye_work, [this, pass] {
             passes_.Open(KeyOf(pass), 1, PhotonsPerPass());
             scheduler_->OpenPass(KeyOf(pass), PhotonsPerPass());
             split_passes_.push_back(pass);
             next_split_ = pass + 1;
             ++split_count_;
             AnswerParked();
           });
      return;
    }
    for (const std::uint64_t pass : split_passes_) {
      if (!passes_.IsComplete(KeyOf(pass))) continue;
      std::erase(split_passes_, pass);
      scheduler_->Close(KeyOf(pass));
      static_cast<void>(passes_.Take(KeyOf(pass)));
      Work(0, 1e-9 * c_.split_slice_ns * Pixels(), [this, pass] {
        SliceSums slice = EmptySlice({pass, pass + 1}, 1, 0);
        LUCERNA_CHECK(rounds_.Merge(KeyOf(RoundOf(pass).first), std::move(slice)).ok());
      });
      return;
    }
    if (!open_rounds_.empty()) {
      const OpenRound oldest = open_rounds_.front();
      if (rounds_.PrefixEnd(KeyOf(oldest.round.first)) == oldest.round.last) {
        if (!oldest.is_split) scheduler_->Close(KeyOf(oldest.round.first));
        static_cast<void>(rounds_.Take(KeyOf(oldest.round.first)));
        open_rounds_.pop_front();
        const auto passes = static_cast<std::int64_t>(oldest.round.last);
        const bool is_due = passes >= next_checkpoint_;
        if (is_due) next_checkpoint_ = NextCheckpoint(passes, false);
        Work(is_due ? 1e-9 * c_.estimate_ns * Pixels() : 0, 1e-9 * c_.statistics_ns * Pixels(),
             [this, oldest] {
               added_ = oldest.round.last;
               if (oldest.round.first == 0) first_image_ = now_;
             });
        return;
      }
    }
    if (to_split && !ahead_) {
      Work(block_work, eye_work, [this, pass = *to_split] { ahead_ = pass; });
    }
  }

  const Costs c_;
  std::mt19937_64 random_;
  double now_ = 0;
  std::priority_queue<Event> events_;
  std::uint64_t next_event_ = 0;

  std::unique_ptr<Scheduler> scheduler_;
  ParkedSyncs parked_;
  PassMerger passes_;
  RoundMerger rounds_;
  std::vector<Worker> workers_;
  Link in_, out_;  // of the coordinator
  std::deque<Commit> pool_;
  double pool_running_ = 0;

  bool job_is_busy_ = false, job_is_parallel_ = false;
  std::uint64_t added_ = 0, next_round_ = 0, next_split_ = 0;
  std::deque<OpenRound> open_rounds_;
  std::vector<std::uint64_t> split_passes_;
  std::optional<std::uint64_t> ahead_;
  std::int64_t next_checkpoint_ = kFirstCheckpoint;

  CallTimes times_;
  double useful_ = 0, useful_late_ = 0, capacity_ = 0, capacity_late_ = 0;  // [core s]
  double here_ = 0, waiting_ = 0;                                           // [worker s]
  double photons_ = 0, first_image_ = 0, coordinator_work_ = 0, job_busy_ = 0, pool_busy_ = 0;
  std::uint64_t rpcs_ = 0, split_count_ = 0;
  double reported_in_ = 0, reported_out_ = 0;
};

void PrintHelp() {
  std::printf("--workers N[,N]... (1)\n");
  const Costs costs;
  for (const Option& option : kOptions)
    std::printf("--%s (%g) %s\n", option.name, costs.*option.value, option.unit);
}

int Main(int argc, char** argv) {
  Costs costs;
  std::vector<int> workers = {1};
  for (int i = 1; i < argc; i += 2) {
    std::string_view name = argv[i];
    if (name == "--help" || i + 1 >= argc || !name.starts_with("--")) {
      PrintHelp();
      return name == "--help" ? 0 : 2;
    }
    name.remove_prefix(2);
    if (name == "workers") {
      workers.clear();
      for (char* at = argv[i + 1]; *at != '\0';) {
        workers.push_back(static_cast<int>(std::strtol(at, &at, 10)));
        if (*at == ',') ++at;
      }
      continue;
    }
    const auto* option = std::ranges::find_if(
        kOptions, [&](const Option& candidate) { return name == candidate.name; });
    if (option == kOptions.end()) {
      PrintHelp();
      return 2;
    }
    costs.*option->value = std::atof(argv[i + 1]);
  }
  Farm::PrintHeader();
  for (const int count : workers) {
    Farm farm(costs, count);
    farm.Run();
    farm.Print();
  }
  return 0;
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  return lucerna::Main(argc, argv);
}
