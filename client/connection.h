// How does the client talk to the coordinator?
//
// Every call has a deadline. Calls that may be made twice (all of them: a submission carries its
// own request_id) are tried again with growing pauses when the coordinator is starting, draining
// or out of reach for a moment; a broken Watch is opened again.
//
// Texts in what it returns are escaped (client/foreign_text.h).
//
// Errors of every call: Failure(kUnreachable) when the coordinator stays silent,
// Failure(kInterrupted) when the user ended the program, else what the coordinator said.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "proto/lucerna/v1/admin.grpc.pb.h"
#include "proto/lucerna/v1/assets.grpc.pb.h"
#include "proto/lucerna/v1/images.grpc.pb.h"
#include "proto/lucerna/v1/jobs.grpc.pb.h"
#include "render/base/status.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene_files.h"
#include "render/wire/channel.h"

namespace lucerna {

class ClientConnection {
 public:
  // Connects, and waits a few seconds for a coordinator that is not there, longer for a slow line.
  // Errors: also Failure(kUsage) for an address that is none, or for certificates or a token that
  // cannot be used.
  [[nodiscard]] static StatusOr<std::unique_ptr<ClientConnection>> Open(const Endpoint& endpoint);

  // Brings the files of `manifest` that the coordinator does not have. `files` reads them anew.
  // Errors: FAILED_PRECONDITION when a file is no longer what the manifest says.
  [[nodiscard]] Status Upload(const SceneManifest& manifest, SceneFiles& files);

  // Brings bytes that are no file of a scene, unless they are there.
  [[nodiscard]] StatusOr<Digest> UploadBytes(std::string_view bytes);

  [[nodiscard]] StatusOr<v1::SubmitResponse> Submit(const v1::SubmitRequest& request);
  // Summaries of all jobs that `filter` lets pass, newest first. Its page is not used.
  [[nodiscard]] StatusOr<std::vector<v1::Job>> List(const v1::ListJobsRequest& filter = {});
  [[nodiscard]] StatusOr<v1::Job> Get(const std::string& job_id);
  [[nodiscard]] StatusOr<v1::Job> Cancel(const std::string& job_id);
  [[nodiscard]] Status Delete(const std::string& job_id);
  [[nodiscard]] StatusOr<v1::Job> Stop(const std::string& job_id);
  [[nodiscard]] StatusOr<v1::Job> Pause(const std::string& job_id);
  [[nodiscard]] StatusOr<v1::Job> Resume(const std::string& job_id);
  [[nodiscard]] StatusOr<v1::Job> SetPriority(const std::string& job_id, int priority);
  // Only the stop criteria of `until` may be set.
  [[nodiscard]] StatusOr<v1::Job> Extend(const std::string& job_id, const RenderOverrides& until);

  [[nodiscard]] StatusOr<std::vector<v1::Worker>> ListWorkers();
  // Errors: also NOT_FOUND.
  [[nodiscard]] StatusOr<v1::Worker> DrainWorker(const std::string& worker_id);
  [[nodiscard]] StatusOr<v1::Worker> QuarantineWorker(const std::string& worker_id);
  [[nodiscard]] StatusOr<v1::Worker> ReleaseWorker(const std::string& worker_id);

  // Called with the newest state of the job, several times a second. A failure ends the watch.
  using OnJob = std::function<Status(const v1::Job& job)>;
  // Follows the job until it has ended; returns its last state. `on_job` runs in the calling
  // thread; before the first news it is called with an empty Job, state UNSPECIFIED.
  [[nodiscard]] StatusOr<v1::Job> Watch(const std::string& job_id, const OnJob& on_job);

  // The bytes of the job's EXR file, or of what a bake made. Whoever may lose interest says so by
  // `gives_up`, which is called several times a second, also from another thread; then ABORTED.
  // Threads: any, beside other calls.
  [[nodiscard]] StatusOr<std::string> GetImage(
      const std::string& job_id, const std::function<bool()>& gives_up = [] { return false; });
  // The mesh of a job that made a light map, as glTF.
  [[nodiscard]] StatusOr<std::string> GetUvMesh(const std::string& job_id);
  // The timeline of a job that was submitted to be traced, in Chrome's trace format.
  [[nodiscard]] StatusOr<std::string> GetTrace(const std::string& job_id);

 private:
  ClientConnection(Endpoint endpoint, const std::shared_ptr<grpc::Channel>& channel);

  // Makes `call` until it succeeds or trying again makes no sense.
  [[nodiscard]] Status Retry(Duration time_for_one,
                             const std::function<grpc::Status(grpc::ClientContext&)>& call);
  [[nodiscard]] Status UploadBlob(const Digest& digest, std::string_view bytes);
  // All bytes of a stream of chunks; `what` is for messages.
  using OpenReader =
      std::function<std::unique_ptr<grpc::ClientReader<v1::Chunk>>(grpc::ClientContext*)>;
  [[nodiscard]] StatusOr<std::string> ReadChunks(const char* what, const OpenReader& open,
                                                 const std::function<bool()>& gives_up);
  // What gRPC says of a connection that could not be made.
  [[nodiscard]] std::string WhyNotConnected();
  // What the coordinator said.
  [[nodiscard]] Status Said(const grpc::Status& status) const;
  [[nodiscard]] Status Unreachable(const std::string& grpc_message = "") const;

  using OrderWorker = grpc::Status (v1::AdminService::Stub::*)(grpc::ClientContext*,
                                                               const v1::WorkerRequest&,
                                                               v1::Worker*);
  [[nodiscard]] StatusOr<v1::Worker> Order(OrderWorker order, const std::string& worker_id);

  const Endpoint endpoint_;
  std::unique_ptr<v1::AdminService::Stub> admin_;
  std::unique_ptr<v1::AssetService::Stub> assets_;
  std::unique_ptr<v1::JobService::Stub> jobs_;
  std::unique_ptr<v1::ImageService::Stub> images_;
};

}  // namespace lucerna
