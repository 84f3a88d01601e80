#include "server/admin_service.h"

#include <algorithm>

#include "render/wire/grpc_status.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

v1::WorkerState StateOf(const WorkerRecord& record) {
  switch (record.state) {
    case WorkerState::kActive:
      return v1::WORKER_STATE_ACTIVE;
    case WorkerState::kDraining:
      return record.held == 0 ? v1::WORKER_STATE_DRAINED : v1::WORKER_STATE_DRAINING;
    case WorkerState::kQuarantined:
      return v1::WORKER_STATE_QUARANTINED;
  }
  return v1::WORKER_STATE_UNSPECIFIED;
}

}  // namespace

v1::Worker AdminService::ToProto(const WorkerRecord& record) const {
  v1::Worker message;
  message.set_worker_id(record.id);
  message.set_name(record.name);
  message.set_state(StateOf(record));
  message.set_reason(record.reason);
  message.set_is_connected(record.is_connected);
  message.set_leases_held(static_cast<int>(record.held));
  message.set_committed(record.leases.committed);
  message.set_failed(record.leases.failed);
  message.set_stalled(record.leases.stalled);
  message.set_lost(record.leases.lost);
  message.set_crashed(record.leases.crashed);
  *message.mutable_silent() = lucerna::ToProto(clock_.Steady() - record.heard_at);
  return message;
}

grpc::ServerUnaryReactor* AdminService::Answer(grpc::CallbackServerContext* context,
                                               const Status& status, const std::string& worker_id,
                                               v1::Worker* response) const {
  if (status.ok()) {
    const std::vector<WorkerRecord> workers = coordinator_.ListWorkers();
    const auto found = std::ranges::find(workers, worker_id, &WorkerRecord::id);
    if (found != workers.end()) *response = ToProto(*found);
  }
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(ToGrpc(status));
  return reactor;
}

grpc::ServerUnaryReactor* AdminService::ListWorkers(grpc::CallbackServerContext* context,
                                                    const v1::ListWorkersRequest* /*request*/,
                                                    v1::ListWorkersResponse* response) {
  for (const WorkerRecord& record : coordinator_.ListWorkers())
    *response->add_workers() = ToProto(record);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::ServerUnaryReactor* AdminService::DrainWorker(grpc::CallbackServerContext* context,
                                                    const v1::WorkerRequest* request,
                                                    v1::Worker* response) {
  const std::string& id = request->worker_id();
  return Answer(context, coordinator_.DrainWorker(id), id, response);
}

grpc::ServerUnaryReactor* AdminService::QuarantineWorker(grpc::CallbackServerContext* context,
                                                         const v1::WorkerRequest* request,
                                                         v1::Worker* response) {
  const std::string& id = request->worker_id();
  return Answer(context, coordinator_.QuarantineWorker(id, "by an operator"), id, response);
}

grpc::ServerUnaryReactor* AdminService::ReleaseWorker(grpc::CallbackServerContext* context,
                                                      const v1::WorkerRequest* request,
                                                      v1::Worker* response) {
  const std::string& id = request->worker_id();
  return Answer(context, coordinator_.ReleaseWorker(id), id, response);
}

}  // namespace lucerna
