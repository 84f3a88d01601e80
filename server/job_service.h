// The gRPC service through which users submit jobs and follow them.
//
// Turns messages into values, calls the coordinator, and turns the result back. Nothing is decided
// here except when a watcher hears of a change: at most ten times a second, at least every five
// seconds, and at once when the job's state is another. All watchers of a job are sent the same
// bytes, which are made once; a watcher that is slow is sent the newest when it has taken the last.
//
// Threads: gRPC calls in from its own pool. Handlers never wait; Submit reads the scene in the pool
// for scenes.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "server/access.h"
#include "server/coordinator.h"
#include "server/work_pool.h"

namespace lucerna {

// Watch takes and gives bytes as they are on the wire.
class JobService final
    : public v1::JobService::WithRawCallbackMethod_Watch<v1::JobService::CallbackService> {
 public:
  // All outlive the service.
  JobService(Coordinator& coordinator, WorkPools& pools, const Clock& clock,
             const Access& access = Access::Unrestricted())
      : coordinator_(coordinator), pools_(pools), clock_(clock), access_(access) {}

  grpc::ServerUnaryReactor* Submit(grpc::CallbackServerContext* context,
                                   const v1::SubmitRequest* request,
                                   v1::SubmitResponse* response) override;
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context,
                                const v1::GetJobRequest* request, v1::Job* response) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context,
                                 const v1::ListJobsRequest* request,
                                 v1::ListJobsResponse* response) override;
  grpc::ServerUnaryReactor* Stop(grpc::CallbackServerContext* context,
                                 const v1::StopJobRequest* request, v1::Job* response) override;
  grpc::ServerUnaryReactor* Extend(grpc::CallbackServerContext* context,
                                   const v1::ExtendJobRequest* request, v1::Job* response) override;
  grpc::ServerUnaryReactor* Cancel(grpc::CallbackServerContext* context,
                                   const v1::CancelJobRequest* request, v1::Job* response) override;
  grpc::ServerUnaryReactor* Pause(grpc::CallbackServerContext* context,
                                  const v1::PauseJobRequest* request, v1::Job* response) override;
  grpc::ServerUnaryReactor* Resume(grpc::CallbackServerContext* context,
                                   const v1::ResumeJobRequest* request, v1::Job* response) override;
  grpc::ServerUnaryReactor* SetPriority(grpc::CallbackServerContext* context,
                                        const v1::SetJobPriorityRequest* request,
                                        v1::Job* response) override;
  grpc::ServerUnaryReactor* Delete(grpc::CallbackServerContext* context,
                                   const v1::DeleteJobRequest* request,
                                   v1::DeleteJobResponse* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* Watch(grpc::CallbackServerContext* context,
                                                    const grpc::ByteBuffer* request) override;

  // To be called every 50 ms or so: sends watchers what has changed.
  void Tick();
  // Ends all watches with UNAVAILABLE.
  void Close();

 private:
  class WatchReactor;
  // A job as it was at one moment.
  struct Snapshot {
    SteadyTime made_at;
    JobTable::News news;
    bool has_ended = false;
    Status failure;  // of a job that there is not (any more)
    grpc::ByteBuffer bytes;
  };
  // Makes a new snapshot of the job if it is time to; returns the newest.
  std::shared_ptr<const Snapshot> Refresh(const std::string& job_id) LUCERNA_REQUIRES(mutex_);

  // Answers with what `change` returns, if the caller may change the job: in a thread of the pool,
  // because a change waits for the disk.
  grpc::ServerUnaryReactor* Change(grpc::CallbackServerContext* context, const std::string& job_id,
                                   v1::Job* response, std::function<StatusOr<JobReport>()> change);
  // OK when the caller may change this job. Errors: NOT_FOUND, PERMISSION_DENIED.
  [[nodiscard]] Status CheckMayChange(const grpc::CallbackServerContext* context,
                                      const std::string& job_id) const;

  Coordinator& coordinator_;
  WorkPools& pools_;
  const Clock& clock_;
  const Access& access_;
  Mutex mutex_;
  bool is_closed_ LUCERNA_GUARDED_BY(mutex_) = false;
  std::set<WatchReactor*> watches_ LUCERNA_GUARDED_BY(mutex_);
  std::map<std::string, std::size_t> watches_of_ LUCERNA_GUARDED_BY(mutex_);  // by caller
  // Of jobs that are watched.
  std::map<std::string, std::shared_ptr<const Snapshot>> snapshots_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
