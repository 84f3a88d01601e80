#include "render/wire/metrics.h"

#include <algorithm>
#include <exception>
#include <fstream>

#include "absl/strings/str_cat.h"
#include <prometheus/collectable.h>
#include <prometheus/exposer.h>
#include <prometheus/metric_family.h>
#include <sys/resource.h>
#include <unistd.h>

#include "render/base/clock.h"

namespace lucerna {
namespace {

prometheus::ClientMetric Labelled(MetricLabels labels) {
  prometheus::ClientMetric metric;
  for (auto& [name, value] : labels) {
    prometheus::ClientMetric::Label label;
    label.name = std::move(name);
    label.value = std::move(value);
    metric.label.push_back(std::move(label));
  }
  return metric;
}

}  // namespace

MetricsPage::MetricsPage() = default;
MetricsPage::~MetricsPage() = default;

prometheus::MetricFamily& MetricsPage::FamilyOf(std::string_view name, std::string_view help,
                                                int type) {
  const auto found = std::ranges::find_if(
      families_, [&](const prometheus::MetricFamily& family) { return family.name == name; });
  if (found != families_.end()) return *found;
  prometheus::MetricFamily& family = families_.emplace_back();
  family.name = name;
  family.help = help;
  family.type = static_cast<prometheus::MetricType>(type);
  return family;
}

void MetricsPage::Gauge(std::string_view name, std::string_view help, double value,
                        MetricLabels labels) {
  prometheus::ClientMetric metric = Labelled(std::move(labels));
  metric.gauge.value = value;
  FamilyOf(name, help, static_cast<int>(prometheus::MetricType::Gauge))
      .metric.push_back(std::move(metric));
}

void MetricsPage::Counter(std::string_view name, std::string_view help, double value,
                          MetricLabels labels) {
  prometheus::ClientMetric metric = Labelled(std::move(labels));
  metric.counter.value = value;
  FamilyOf(name, help, static_cast<int>(prometheus::MetricType::Counter))
      .metric.push_back(std::move(metric));
}

void MetricsPage::Histogram(std::string_view name, std::string_view help,
                            const LatencyCounts& counts, MetricLabels labels) {
  prometheus::ClientMetric metric = Labelled(std::move(labels));
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i <= LatencyCounts::kBounds.size(); ++i) {
    sum += counts.CountBelow(i);
    if (i == LatencyCounts::kBounds.size()) break;
    prometheus::ClientMetric::Bucket bucket;
    bucket.cumulative_count = sum;
    bucket.upper_bound = LatencyCounts::kBounds[i];
    metric.histogram.bucket.push_back(bucket);
  }
  metric.histogram.sample_count = sum;
  metric.histogram.sample_sum = counts.seconds();
  FamilyOf(name, help, static_cast<int>(prometheus::MetricType::Histogram))
      .metric.push_back(std::move(metric));
}

void MetricsPage::Process() {
  Counter("process_cpu_seconds_total", "Processor time of this process.",
          std::chrono::duration<double>(ProcessCpuTime()).count());
  std::uint64_t pages = 0;
  std::uint64_t resident = 0;
  if (std::ifstream statm("/proc/self/statm"); statm >> pages >> resident) {
    Gauge("process_resident_memory_bytes", "Memory of this process that is in use.",
          static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)));
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    Gauge("process_max_fds", "Descriptors that this process may open.",
          static_cast<double>(limit.rlim_cur));
  }
}

struct MetricsListener::Server {
  struct Page : prometheus::Collectable {
    explicit Page(Fill fill_in) : fill(std::move(fill_in)) {}
    [[nodiscard]] std::vector<prometheus::MetricFamily> Collect() const override {
      MetricsPage filled;
      fill(filled);
      return std::move(filled.families_);
    }
    Fill fill;
  };

  std::shared_ptr<Page> page;
  std::unique_ptr<prometheus::Exposer> exposer;  // last: it ends before the page
};

MetricsListener::MetricsListener() = default;
MetricsListener::~MetricsListener() = default;

StatusOr<std::unique_ptr<MetricsListener>> MetricsListener::Start(const std::string& address,
                                                                  Fill fill) {
  std::unique_ptr<MetricsListener> listener(new MetricsListener);
  listener->server_ = std::make_unique<Server>();
  try {
    constexpr std::size_t kThreads = 2;
    listener->server_->exposer = std::make_unique<prometheus::Exposer>(address, kThreads);
  } catch (const std::exception& error) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", address, ": ", error.what()));
  }
  listener->server_->page = std::make_shared<Server::Page>(std::move(fill));
  listener->server_->exposer->RegisterCollectable(listener->server_->page);
  const std::vector<int> ports = listener->server_->exposer->GetListeningPorts();
  listener->address_ =
      absl::StrCat(address.substr(0, address.rfind(':')), ":", ports.empty() ? 0 : ports.front());
  return listener;
}

}  // namespace lucerna
