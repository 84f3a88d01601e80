// Serves a program's metrics over HTTP, in the text format of Prometheus.
//
// What the metrics are is asked for with every request: a program without a listener computes none.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/base/latency_counts.h"
#include "render/base/status.h"

namespace prometheus {
struct MetricFamily;
}  // namespace prometheus

namespace lucerna {

using MetricLabels = std::vector<std::pair<std::string, std::string>>;

// The metrics of one request, in the order in which they are added.
class MetricsPage {
 public:
  MetricsPage();
  ~MetricsPage();
  MetricsPage(const MetricsPage&) = delete;
  MetricsPage& operator=(const MetricsPage&) = delete;

  // Another sample of a metric adds to it; its help is that of the first. A counter only grows
  // while the process lives.
  void Gauge(std::string_view name, std::string_view help, double value, MetricLabels labels = {});
  void Counter(std::string_view name, std::string_view help, double value,
               MetricLabels labels = {});
  void Histogram(std::string_view name, std::string_view help, const LatencyCounts& counts,
                 MetricLabels labels = {});
  // Processor time and memory of this process, under the names that Prometheus's own clients use.
  void Process();

 private:
  friend class MetricsListener;
  prometheus::MetricFamily& FamilyOf(std::string_view name, std::string_view help, int type);

  std::vector<prometheus::MetricFamily> families_;
};

class MetricsListener {
 public:
  using Fill = std::function<void(MetricsPage&)>;

  // Answers GET /metrics at "HOST:PORT"; port 0 picks a free one. `fill` is called from other
  // threads until the listener ends. Errors: UNAVAILABLE when it cannot listen there.
  [[nodiscard]] static StatusOr<std::unique_ptr<MetricsListener>> Start(const std::string& address,
                                                                        Fill fill);
  ~MetricsListener();
  MetricsListener(const MetricsListener&) = delete;
  MetricsListener& operator=(const MetricsListener&) = delete;

  // "HOST:PORT", with the port that it has.
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  struct Server;
  MetricsListener();

  std::string address_;
  std::unique_ptr<Server> server_;
};

}  // namespace lucerna
