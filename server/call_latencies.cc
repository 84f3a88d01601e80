#include "server/call_latencies.h"

namespace lucerna {

class CallLatencies::Call final : public grpc::experimental::Interceptor {
 public:
  Call(LatencyCounts& counts, const Clock& clock)
      : counts_(counts), clock_(clock), began_at_(clock.Steady()) {}
  ~Call() override { counts_.Count(clock_.Steady() - began_at_); }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    methods->Proceed();
  }

 private:
  LatencyCounts& counts_;
  const Clock& clock_;
  const SteadyTime began_at_;
};

class CallLatencies::Factories final
    : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit Factories(CallLatencies& latencies) : latencies_(latencies) {}

  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* info) override {
    return new Call(latencies_.CountsOf(info->method()), latencies_.clock_);
  }

 private:
  CallLatencies& latencies_;
};

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CallLatencies::Factory() {
  return std::make_unique<Factories>(*this);
}

LatencyCounts& CallLatencies::CountsOf(const char* method) {
  const MutexLock lock(mutex_);
  std::unique_ptr<LatencyCounts>& counts = counts_[method == nullptr ? "" : method];
  if (counts == nullptr) counts = std::make_unique<LatencyCounts>();
  return *counts;
}

void CallLatencies::ForEach(
    const std::function<void(const std::string& method, const LatencyCounts&)>& visit) const {
  const MutexLock lock(mutex_);
  for (const auto& [method, counts] : counts_)
    visit(method, *counts);
}

}  // namespace lucerna
